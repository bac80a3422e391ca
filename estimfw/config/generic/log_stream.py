"""One logged stream: a file, its time column, the units of its columns."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from estimfw.config.types import Settings, positive_quantity, quantity
from estimfw.data.readers.file_there import refuse_missing_file
from estimfw.data.readers.named_columns import read_columns
from estimfw.data.readers.npz_arrays import array_names, npz_fault, read_arrays
from estimfw.data.record import SAME, Event, FloatArray, Stream
from estimfw.data.row_order import Rows, TimeErrors, in_order
from estimfw.data.sampling import check_rate
from estimfw.errors import ConfigError, DataError, Location
from estimfw.spelling import did_you_mean
from estimfw.units import parse_unit, si_name

__all__ = ["LogStreamConfig", "read_stream"]

_FORMATS = {".csv": "csv", ".tsv": "csv", ".txt": "csv", ".npz": "npz"}
_TIME = {"csv": "time", "npz": "t"}


class LogStreamConfig(Settings):
    """A text table with a header line of column names, or a NumPy archive; columns that nothing reads are ignored.

    A reading holds at its time stamp. ``units`` gives the unit of a column where it is not SI, by the column's name. With
    ``arrival`` rows may stand in the order in which they came, and those that a live filter would have met too late are not
    fused; see ``replay`` of the estimator.
    """

    file: Annotated[str, Field(description="path of the file")]
    format: Annotated[Literal["auto", "csv", "npz"], Field(description="auto: by the suffix")] = "auto"
    time: Annotated[str | None, Field(description="column of the time stamps (CSV: time, NPZ: t)")] = None
    time_unit: Annotated[str, Field(description="unit of the time stamps, such as ms")] = "s"
    arrival: Annotated[
        str | None,
        Field(description="column that says when each row arrived, in time_unit: a row is used if it was in time then"),
    ] = None
    units: Annotated[
        dict[str, str], Field(description="unit of a column where it is not SI, by the column's name")
    ] = {}
    rate: Annotated[
        Annotated[float, positive_quantity("Hz")] | None, Field(description="nominal; the time stamps must show it")
    ] = None
    start: Annotated[Annotated[float, quantity("s")] | None, Field(description="rows after this instant")] = None
    stop: Annotated[Annotated[float, quantity("s")] | None, Field(description="rows up to this instant")] = None
    separator: Annotated[str, Field(min_length=1, max_length=1, description="between the columns of a table")] = ","
    decimal: Annotated[Literal[".", ","], Field(description="decimal mark in a table")] = "."
    time_errors: Annotated[TimeErrors, Field(description="what becomes of rows that go back in time")] = "error"


def read_stream(
    name: str, cfg: LogStreamConfig, needed: Mapping[str, str]
) -> tuple[Stream, tuple[Event, ...], dict[str, object]]:
    """The stream in SI, what was found on the way, and where it comes from (JSON values).

    Parameters
    ----------
    name : str
        Of the stream.
    cfg : LogStreamConfig
    needed : mapping of str to str
        Columns to read, and the SI unit that each has in the model; empty: nobody says which.

    Raises
    ------
    DataError
        The file cannot be read or trusted.
    ConfigError
        A unit of the wrong dimension, or for a column that is not read.
    """
    path = Path(cfg.file)
    scales, time_scale = _scales(cfg, needed), _scale(cfg.time_unit, "s", "the time", ("time_unit",))
    rows, period = _rows(name, path, cfg, tuple(needed))
    arrival = rows.arrival * time_scale if rows.arrival is not None else None
    rows = Rows(rows.file, rows.time * time_scale, rows.values * scales, rows.lines, name, arrival)
    count = rows.time.size
    rows, early = _as_they_came(rows)
    rows, events = in_order(rows, "sort" if arrival is not None and cfg.time_errors == "error" else cfg.time_errors)
    rows = _cut(rows, cfg)
    nominal = 1.0 / cfg.rate if cfg.rate is not None else period
    if nominal is not None:
        check_rate(rows.time, nominal, Location(str(path)))
    rows, missing = _without_infinities(rows, tuple(needed))
    facts: dict[str, object] = {
        "file": str(path),
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "rows": int(count),
        "rows_used": int(rows.time.size),
    }
    made = Stream(name, rows.time, rows.values, tuple(needed), "sample", nominal, rows.arrival)
    return made, (*early, *events, *missing), facts


def _rows(name: str, path: Path, cfg: LogStreamConfig, columns: tuple[str, ...]) -> tuple[Rows, float | None]:
    """Rows as they stand in the file, and the sampling interval (s) where it says one."""
    refuse_missing_file(path, f"the log of stream {name!r}")
    format = cfg.format if cfg.format != "auto" else _FORMATS.get(path.suffix.lower(), "")
    if not format:
        raise DataError(
            f"the suffix {path.suffix!r} does not tell the format",
            location=Location(str(path)),
            hint="say `format: csv` or `format: npz`",
        )
    time = cfg.time or _TIME[format]
    read = columns if cfg.arrival in (None, *columns) else (*columns, str(cfg.arrival))
    try:
        if format == "npz":
            rows, period = _archive(path, time, read)
        else:
            values, lines = read_columns(path, (time, *read), cfg.separator, cfg.decimal)
            rows, period = Rows(str(path), values[:, 0], values[:, 1:], lines), None
    except OSError as cause:
        raise DataError(f"cannot read the log: {cause.strerror or cause}", location=Location(str(path))) from cause
    if cfg.arrival is None:
        return rows, period
    return replace(rows, values=rows.values[:, : len(columns)], arrival=rows.values[:, read.index(cfg.arrival)]), period


def _as_they_came(rows: Rows) -> tuple[Rows, tuple[Event, ...]]:
    """Rows in the order of their arrival, where the log says it, and an event if some came before their own instant."""
    if rows.arrival is None:
        return rows, ()
    holes = np.flatnonzero(~np.isfinite(rows.arrival))
    if holes.size:
        raise DataError(f"row {holes[0] + 1} does not say when it arrived", location=rows.at(int(holes[0])))
    early = rows.arrival < rows.time - SAME
    events: tuple[Event, ...] = ()
    if early.any():
        first, by = int(np.argmax(early)), float(np.max((rows.time - rows.arrival)[early]))
        text = (
            f"rows arrive up to {by:.6g} s before their own instant, first in {rows.at(first)}: the clocks do not agree"
        )
        events = (Event(float(rows.time[first]), rows.stream, "early", text, int(early.sum())),)
    return rows.take(np.argsort(rows.arrival, kind="stable")), events


def _archive(path: Path, time: str, columns: tuple[str, ...]) -> tuple[Rows, float | None]:
    """Arrays (N,) by name, or the columns ``a_x, a_y, a_z`` of an array ``a`` (N, 3)."""
    there = array_names(path)
    source = {c: c[:-2] if c not in there and c[:-2] in there and c[-2:] in ("_x", "_y", "_z") else c for c in columns}
    arrays = read_arrays(path, tuple(dict.fromkeys((time, *source.values()))), ("dt",))
    stamps = arrays[time]
    if stamps.ndim != 1 or not stamps.size:
        raise npz_fault(path, f"{time} has shape {stamps.shape}", "expected (N,) with a row or more")
    values = np.empty((stamps.size, len(columns)))
    for i, column in enumerate(columns):
        array, own = arrays[source[column]], source[column] == column
        if array.shape != ((stamps.size,) if own else (stamps.size, 3)):
            raise npz_fault(path, f"{source[column]} has shape {array.shape}, {time} has {stamps.shape}", "cut off?")
        values[:, i] = array if own else array[:, "xyz".index(column[-1])]
    dt = arrays.get("dt")
    return Rows(str(path), stamps, values), float(dt.item()) if dt is not None and dt.size == 1 else None


def _scales(cfg: LogStreamConfig, needed: Mapping[str, str]) -> FloatArray:
    for column in cfg.units:
        if column not in needed:
            raise ConfigError(
                f"nothing reads the column {column!r}",
                hint=did_you_mean(column, needed),
                within=("units", column),
            )
    return np.array(
        [_scale(cfg.units.get(c, unit or "1"), unit, f"column {c!r}", ("units", c)) for c, unit in needed.items()]
    )


def _scale(unit: str, si: str, what: str, within: tuple[str, ...]) -> float:
    try:
        found = parse_unit(unit)
    except ConfigError as error:
        error.within = within
        raise
    if si and found.dimension != parse_unit(si).dimension:
        raise ConfigError(
            f"the unit of {what} is {unit!r}, which is in {si_name(found)}, not in {si}",
            hint=f"a unit of the dimension of {si} is due",
            within=within,
        )
    return float(found.scale)


def _cut(rows: Rows, cfg: LogStreamConfig) -> Rows:
    inside = rows.between(cfg.start, cfg.stop)
    if not inside.time.size:
        raise DataError(
            f"no row is left between `start` and `stop`; the log goes from {rows.time[0]:.10g} s to {rows.time[-1]:.10g} s",
            location=Location(rows.file),
        )
    return inside


def _without_infinities(rows: Rows, columns: tuple[str, ...]) -> tuple[Rows, tuple[Event, ...]]:
    """What is not finite becomes NaN, which the filter skips; one event a column says how often."""
    bad = ~np.isfinite(rows.values)
    if not bad.any():
        return rows, ()
    events = []
    for i in np.flatnonzero(bad.any(axis=0)):
        first, count = int(np.argmax(bad[:, i])), int(bad[:, i].sum())
        what = f"a reading of {columns[i]!r} is" if count == 1 else f"{count} readings of {columns[i]!r} are"
        text = f"{what} missing or not finite and skipped{', first' if count > 1 else ''} in {rows.at(first)}"
        events.append(Event(float(rows.time[first]), rows.stream, "missing", text, count))
    values = np.where(bad, np.nan, rows.values)
    return replace(rows, values=values), tuple(events)
