"""Text tables with a header line of column names."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import ConfigError, DataError, Location
from estimfw.spelling import did_you_mean
from estimfw.units import parse_unit
from estimfw_inertial.readers.imu_log import ImuLog, imu_stream
from estimfw_inertial.readers.layout import CsvLayout
from estimfw_inertial.readers.number_table import NumberTable, decoded

__all__ = ["read"]

FloatArray = NDArray[np.float64]

_SEPARATORS = (",", ";", "\t", "|", " ")


def read(path: Path, layout: CsvLayout) -> ImuLog:
    """Read a CSV log. Blank lines and lines with ``#`` before the header are skipped; further columns are ignored.

    Raises
    ------
    DataError
        With the line: no text, no such column or one twice, another width, a cell that is no number, no rows.
    ConfigError
        A unit of the wrong dimension.
    """
    gyro_unit, accel_unit, time_unit = _scales(layout)
    names, text, first_line = _split_header(path, decoded(path), layout.separator)
    columns = _places(path, names, layout, first_line - 1)
    table = NumberTable(path, text, first_line, len(names), layout.separator, layout.decimal)
    values = table.values(columns)
    time = values[:, 0] * time_unit
    interval = (layout.period or _typical_step(time)) if layout.values == "rate" else 1.0
    dtheta, dvel = values[:, 1:4] * (gyro_unit * interval), values[:, 4:7] * (accel_unit * interval)
    return ImuLog(imu_stream(time, dtheta, dvel, layout.period), lines=table.lines(len(values)))


def _typical_step(time: FloatArray) -> float:
    if time.size < 2:
        return 1.0
    return float(np.nanmedian(np.abs(np.diff(time))))


def _scales(layout: CsvLayout) -> tuple[float, float, float]:
    gyro, accel = ("rad/s", "m/s^2") if layout.values == "rate" else ("rad", "m/s")
    return (
        _scale(layout.gyro_unit, gyro, "the gyros"),
        _scale(layout.accel_unit, accel, "the accelerometers"),
        _scale(layout.time_unit, "s", "time"),
    )


def _scale(unit: str | None, si: str, what: str) -> float:
    found = parse_unit(unit or si)
    if found.dimension != parse_unit(si).dimension:
        raise ConfigError(
            f"the unit of {what} is {unit!r}, which is in {found.si_text}, not in {si}",
            hint="`values: increment` wants rad and m/s, `values: rate` wants rad/s and m/s^2, or multiples of them",
        )
    return float(found.scale)


def _split_header(path: Path, text: str, separator: str) -> tuple[list[str], str, int]:
    """Column names, the text after them, and the line at which it begins."""
    rest, number = text, 0
    while rest:
        line, _, rest = rest.partition("\n")
        number += 1
        if line.strip() and not line.startswith("#"):
            return [name.strip().strip('"') for name in line.split(separator)], rest, number + 1
    raise DataError(
        "the file is empty", location=Location(str(path)), hint="expected a line of column names and rows of numbers"
    )


def _places(path: Path, names: list[str], layout: CsvLayout, line: int) -> tuple[int, ...]:
    """Where the seven columns stand."""
    twice = [name for name, count in Counter(names).items() if count > 1 and name in layout.columns]
    if twice:
        raise DataError(
            f"the column {twice[0]!r} stands {names.count(twice[0])} times in the header",
            location=Location(str(path), line),
            hint=f"found: {', '.join(names)}",
        )
    for name in layout.columns:
        if name not in names:
            raise DataError(
                f"no column {name!r}", location=Location(str(path), line), hint=_missing_hint(name, names, layout)
            )
    return tuple(names.index(name) for name in layout.columns)


def _missing_hint(name: str, names: list[str], layout: CsvLayout) -> str:
    found = f"columns found: {', '.join(repr(n) for n in names[:20])}"
    if len(names) == 1:
        other = [s for s in _SEPARATORS if s != layout.separator and len(names[0].split(s)) >= len(layout.columns)]
        if other:
            return f"{found}; the columns seem to be separated by {other[0]!r}: say `separator: {other[0]!r}`"
    if all(_is_number(n) for n in names):
        return f"{found}; the first line must hold the names of the columns"
    return f"{found}; {did_you_mean(name, names).split(' (valid')[0]}"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
