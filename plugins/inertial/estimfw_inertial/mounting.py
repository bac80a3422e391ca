"""How the IMU is mounted: the turn of its case against the vehicle, taken out of a stream."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Settings, quantity
from estimfw.data.record import Stream
from estimfw.errors import DataError
from estimfw_inertial.rotation import attitude_matrix

__all__ = ["Mounting", "MountingConfig", "mounting"]

FloatArray = NDArray[np.float64]

_ANGLE = quantity("rad", minimum="-360 deg", maximum="360 deg", examples=("90 deg",))


class MountingConfig(Settings):
    """Yaw, pitch and roll of the case against the vehicle; all 0: the axes of the case are the vehicle's."""

    yaw: Annotated[
        float, _ANGLE, Field(description="of the case, counter-clockwise from the vehicle's forward axis")
    ] = 0.0
    pitch: Annotated[float, _ANGLE, Field(description="of the case; its forward axis up is positive")] = 0.0
    roll: Annotated[float, _ANGLE, Field(description="of the case; its right side down is positive")] = 0.0


@dataclass(frozen=True, slots=True)
class Mounting:
    """Angles in rad: ``C = Rz(yaw) Rx(pitch) Ry(roll)`` takes a vector from the axes of the case to b, those of the vehicle."""

    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0

    @property
    def C(self) -> FloatArray:
        """(3, 3), from case to vehicle."""
        return attitude_matrix(self.yaw, self.pitch, self.roll)

    def apply(self, stream: Stream) -> Stream:
        """The stream in vehicle axes: every triad of columns ``name_x, name_y, name_z`` is turned, other columns stay.

        Raises
        ------
        DataError
            The stream has no whole triad.
        """
        triads = _triads(stream.columns)
        if not triads:
            raise DataError(
                f"stream {stream.name!r} has no columns name_x, name_y, name_z that a mounting could turn",
                hint=f"it has {', '.join(stream.columns)}",
            )
        values = stream.values.copy()
        for columns in triads:
            values[:, columns] = stream.values[:, columns] @ self.C.T
        return replace(stream, values=values)


def mounting(cfg: MountingConfig) -> Mounting:
    """The mounting that a config describes."""
    return Mounting(cfg.yaw, cfg.pitch, cfg.roll)


def _triads(columns: tuple[str, ...]) -> list[list[int]]:
    names = [c.removesuffix("_x") for c in columns if c.endswith("_x")]
    triads = [[f"{name}_{axis}" for axis in "xyz"] for name in names]
    return [[columns.index(c) for c in triad] for triad in triads if all(c in columns for c in triad)]
