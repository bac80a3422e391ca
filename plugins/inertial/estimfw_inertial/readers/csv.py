"""Text tables with a header line of column names."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.data.readers.named_columns import read_columns
from estimfw.errors import ConfigError
from estimfw.units import parse_unit
from estimfw_inertial.readers.imu_log import ImuLog, imu_stream
from estimfw_inertial.readers.layout import CsvLayout

__all__ = ["read"]

FloatArray = NDArray[np.float64]

_SI = {"increment": ("rad", "m/s"), "rate": ("rad/s", "m/s^2")}
_SAY_THE_COLUMNS = (
    "name yours: `source.columns={time: ..., gyro: [..., ..., ...], accel: [..., ..., ...]}`, in the order x, y, z"
)
_CUSTOMARY = {
    "increment": "`values: increment` wants `units: {gyro: rad, accel: m/s}`, or such as {gyro: deg, accel: g*s}",
    "rate": "`values: rate` wants `units: {gyro: rad/s, accel: m/s^2}`, or such as {gyro: deg/s, accel: g}",
}


def read(path: Path, layout: CsvLayout) -> ImuLog:
    """Read a CSV log; see `estimfw.data.readers.named_columns`.

    Raises
    ------
    DataError
        With the line: no text, no such column or one twice, another width, a cell that is no number, no rows.
    ConfigError
        A unit of the wrong dimension.
    """
    gyro_unit, accel_unit, time_unit = _scales(layout)
    values, lines = read_columns(path, layout.columns, layout.separator, layout.decimal, _SAY_THE_COLUMNS)
    time = values[:, 0] * time_unit
    interval = (layout.period or _typical_step(time)) if layout.values == "rate" else 1.0
    dtheta, dvel = values[:, 1:4] * (gyro_unit * interval), values[:, 4:7] * (accel_unit * interval)
    return ImuLog(imu_stream(time, dtheta, dvel, layout.period), lines=lines)


def _typical_step(time: FloatArray) -> float:
    if time.size < 2:
        return 1.0
    return float(np.nanmedian(np.abs(np.diff(time))))


def _scales(layout: CsvLayout) -> tuple[float, float, float]:
    gyro, accel = _SI[layout.values]
    return (
        _scale(layout.gyro_unit, gyro, "the gyros", _unit_hint(layout)),
        _scale(layout.accel_unit, accel, "the accelerometers", _unit_hint(layout)),
        _scale(layout.time_unit, "s", "time", "`units: {time: s}`, or ms, us"),
    )


def _unit_hint(layout: CsvLayout) -> str:
    """What the values that were said want, and the other kind of values where the units are those of it."""
    other: Literal["increment", "rate"] = "increment" if layout.values == "rate" else "rate"
    if all(_fits(unit, si) for unit, si in zip((layout.gyro_unit, layout.accel_unit), _SI[other], strict=True)):
        return f"units of the other kind: say `values: {other}`"
    return _CUSTOMARY[layout.values]


def _fits(unit: str | None, si: str) -> bool:
    return unit is None or parse_unit(unit).dimension == parse_unit(si).dimension


def _scale(unit: str | None, si: str, what: str, hint: str) -> float:
    found = parse_unit(unit or si)
    if found.dimension != parse_unit(si).dimension:
        raise ConfigError(f"the unit of {what} is {unit!r}, which is in {found.si_text}, not in {si}", hint=hint)
    return float(found.scale)
