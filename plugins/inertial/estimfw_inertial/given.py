"""The start attitude as a person gives it: ``inertial.given``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from estimfw.config.types import Settings, Site, quantity
from estimfw.data.record import Record
from estimfw.model.nominal import InitialNominal
from estimfw_inertial.rotation import attitude_matrix

__all__ = ["GivenAttitude", "GivenAttitudeConfig", "given_attitude"]

_ANGLE = quantity("rad", minimum="-360 deg", maximum="360 deg", examples=("-92 deg", "5 arcmin"))
_PITCH = quantity("rad", minimum="-90 deg", maximum="90 deg", examples=("0.5 deg",))


class GivenAttitudeConfig(Settings):
    """C_bn = Rz(yaw) Rx(pitch) Ry(roll)."""

    kind: Literal["inertial.given"]
    yaw: Annotated[
        float, _ANGLE, Field(description="counter-clockwise from North; a heading of 92 deg is a yaw of -92 deg")
    ]
    pitch: Annotated[float, _PITCH, Field(description="the nose up is positive")] = 0.0
    roll: Annotated[float, _ANGLE, Field(description="the right side down is positive")] = 0.0


@dataclass(frozen=True, slots=True)
class GivenAttitude:
    """Angles in rad; needs no data."""

    yaw: float
    pitch: float
    roll: float

    def reference(self) -> InitialNominal:
        """The start: C_bn (3, 3)."""
        return InitialNominal({"C_bn": attitude_matrix(self.yaw, self.pitch, self.roll)}, source="given")

    def find(self, record: Record) -> InitialNominal:
        """The given start, or where a simulated record says it starts: misaligned from the given attitude."""
        if "C_bn" in record.initial and record.truth is not None:
            known = {name: record.initial[name] for name in ("C_bn", "velocity_n") if name in record.initial}
            return InitialNominal(known, source="given, misaligned by the simulation")
        return self.reference()


def given_attitude(cfg: GivenAttitudeConfig, site: Site | None) -> GivenAttitude:
    """The finder; it does not depend on the place."""
    return GivenAttitude(cfg.yaw, cfg.pitch, cfg.roll)
