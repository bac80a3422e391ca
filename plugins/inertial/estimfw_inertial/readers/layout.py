"""What the columns of a CSV log mean."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["CsvLayout"]


@dataclass(frozen=True, slots=True)
class CsvLayout:
    """Columns, units and kind of a CSV log.

    Attributes
    ----------
    time : str
        Column of the time stamp.
    gyro, accel : tuple of three str
        Columns of the axes x, y, z.
    values : 'increment' or 'rate'
        Integrals over each interval (rad, m/s), or means over it (rad/s, m/s^2), which are multiplied by its length.
    time_unit, gyro_unit, accel_unit : str or None
        Any unit of the right dimension; None: SI.
    separator, decimal : str
    period : float or None, s
        Nominal sampling interval; None: the median step of the time stamps.
    """

    time: str = "time"
    gyro: tuple[str, str, str] = ("dtheta_x", "dtheta_y", "dtheta_z")
    accel: tuple[str, str, str] = ("dvel_x", "dvel_y", "dvel_z")
    values: Literal["increment", "rate"] = "increment"
    time_unit: str | None = None
    gyro_unit: str | None = None
    accel_unit: str | None = None
    separator: str = ","
    decimal: str = "."
    period: float | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """The seven columns in the order time, gyro, accel."""
        return (self.time, *self.gyro, *self.accel)
