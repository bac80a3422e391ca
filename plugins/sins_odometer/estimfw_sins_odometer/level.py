"""The start of a vehicle that moves: levelled with the specific force of the first second, its heading assumed (I1).

Over a second a vehicle's own acceleration is small beside gravity: ``up_i = U(1 s) / abs(U)``, forward is e_y made orthogonal to
it, and the heading is a guess, or one of several for a bank.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from estimfw_inertial.increments import IMU_COLUMNS
from estimfw_inertial.mounting import MountingConfig, mounting
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from estimfw.config.types import PositiveInt, Settings, Site, positive_quantity, quantity
from estimfw.data.record import Record
from estimfw.errors import DataError
from estimfw.model.nominal import InitialNominal

__all__ = ["Level", "LevelConfig", "attitudes_about", "level"]

FloatArray = NDArray[np.float64]

_ANGLE = quantity("rad", minimum="-360 deg", maximum="360 deg", examples=("92 deg",))


class LevelConfig(Settings):
    """Up from the first second of the accelerometers; the heading is given, or one of several at equal distances."""

    kind: Literal["sins_odometer.level"]
    heading: Annotated[
        float, _ANGLE, Field(description="at the start, clockwise from North; of the first of several")
    ] = 0.0
    headings: Annotated[PositiveInt, Field(description="starts at equal distances around the circle, for a bank")] = 1
    window: Annotated[float, positive_quantity("s"), Field(description="over which it levels")] = 1.0
    skip: Annotated[
        float, quantity("s", minimum="0 s", examples=("2 s",)), Field(description="of the record, before the start")
    ] = 0.0
    tilt_sigma: Annotated[float, positive_quantity("rad"), Field(description="one sigma of the level")] = float(
        np.radians(5.0)
    )
    heading_sigma: Annotated[float, positive_quantity("rad"), Field(description="one sigma of the heading")] = float(
        np.radians(30.0)
    )
    mounting: Annotated[MountingConfig | None, Field(description="turn of the IMU against the vehicle")] = None


@dataclass(frozen=True, slots=True)
class Level:
    """Angles in rad, times in s; ``turn`` is from the axes of the IMU to b."""

    heading: float
    headings: int
    window: float
    skip: float
    tilt_sigma: float
    heading_sigma: float
    turn: tuple[float, ...]
    needs_record: bool = True

    def reference(self) -> InitialNominal:
        """Level, with the (first) heading: what is known before any data."""
        return InitialNominal(
            {"C_bn": attitudes_about(np.array([0.0, 0.0, 1.0]), np.array(self.heading))}, source="level"
        )

    def find(self, record: Record) -> InitialNominal:
        """C_bn (3, 3), or (headings, 3, 3) of several, with the covariance of the attitude in i.

        Raises
        ------
        DataError
            No IMU, or too short a record.
        """
        stream = record.streams.get("imu")
        if stream is None:
            raise DataError(
                "sins_odometer.level needs the stream 'imu'", hint=f"there is {', '.join(record.streams) or 'none'}"
            )
        first = int(np.searchsorted(stream.time, stream.time[0] + self.skip - 1e-9))
        last = int(np.searchsorted(stream.time, stream.time[min(first, len(stream) - 1)] + self.window + 1e-9))
        if last - first < 3 or last > len(stream):
            raise DataError(f"the record is shorter than the {self.skip + self.window:g} s that levelling takes")
        columns = [stream.columns.index(c) for c in IMU_COLUMNS]
        turn = np.array(self.turn).reshape(3, 3)
        rows = stream.values[first + 1 : last][:, columns].reshape(-1, 2, 3) @ turn.T
        up = _integrated_force(rows)
        up /= np.linalg.norm(up)
        spread = self.heading + 2.0 * np.pi / self.headings * np.arange(self.headings)
        C_bn = attitudes_about(up, spread if self.headings > 1 else np.array(self.heading))
        covariance = self.tilt_sigma**2 * np.eye(3) + (self.heading_sigma**2 - self.tilt_sigma**2) * np.outer(up, up)
        return InitialNominal(
            {"C_bn": C_bn},
            covariance={"attitude": covariance},
            time=float(stream.time[first]),
            source=f"levelled over {self.window:g} s, heading assumed",
            candidates=tuple(f"heading {h % 360.0:.5g} deg" for h in np.degrees(spread)) if self.headings > 1 else (),
        )


def attitudes_about(up: ArrayLike, heading: ArrayLike) -> FloatArray:
    """C_bn (..., 3, 3) with this up (3,) in b, forward (e_y without its part along up) at a heading (...) rad."""
    up = np.asarray(up, dtype=float)
    forward = np.array([0.0, 1.0, 0.0]) - up[1] * up
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    s, c = np.sin(heading)[..., None], np.cos(heading)[..., None]
    east, north = c * right + s * forward, c * forward - s * right
    return np.stack([east, north, np.broadcast_to(up, east.shape)], axis=-2)


def _integrated_force(rows: FloatArray) -> FloatArray:
    """U (3,) m/s over rows (N, 2, 3) of dtheta and dvel, in the axes of their start."""
    from scipy.spatial.transform import Rotation

    total, C = np.zeros(3), Rotation.identity()
    for dtheta, dvel in rows:
        total = total + C.apply(dvel + 0.5 * np.cross(dtheta, dvel))
        C = C * Rotation.from_rotvec(dtheta)
    return total


def level(cfg: LevelConfig, site: Site | None) -> Level:
    """The finder that a config describes."""
    turn = mounting(cfg.mounting).C if cfg.mounting is not None else np.eye(3)
    return Level(
        cfg.heading, cfg.headings, cfg.window, cfg.skip, cfg.tilt_sigma, cfg.heading_sigma, tuple(turn.ravel().tolist())
    )  # fmt: skip
