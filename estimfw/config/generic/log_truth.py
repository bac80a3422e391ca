"""What really was, from a file: the truth that ``simulate`` writes, or a reference far better than what is estimated."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from estimfw.config.types import Names, Settings
from estimfw.data.readers.file_there import refuse_missing_file
from estimfw.data.readers.named_columns import read_columns
from estimfw.data.readers.npz_arrays import array_names, npz_fault, read_arrays
from estimfw.data.record import FloatArray, Truth, truth_name
from estimfw.errors import ConfigError, DataError, Location
from estimfw.spelling import did_you_mean
from estimfw.units import parse_unit

__all__ = ["LogTruthConfig", "read_truth"]

_TIME = {"csv": "time", "npz": "t"}


class LogTruthConfig(Settings):
    """A NumPy archive with the truths under their names, as ``simulate`` writes it, or a table whose columns are named here.

    Truths have the names that the plugins give them, such as ``latitude`` or ``velocity_t``. Between its instants a truth is
    interpolated; before the first and after the last it is not known.
    """

    file: Annotated[str, Field(description="path of the file")]
    format: Annotated[Literal["auto", "csv", "npz"], Field(description="auto: npz by the suffix .npz, else csv")] = (
        "auto"
    )
    time: Annotated[str | None, Field(description="column of the time stamps (CSV: time, NPZ: t)")] = None
    time_unit: Annotated[str, Field(description="unit of the time stamps, such as ms")] = "s"
    columns: Annotated[
        dict[str, str | Names],
        Field(description="by the name of a truth its column or columns (left out: every array of an archive)"),
    ] = {}
    units: Annotated[
        dict[str, str], Field(description="unit of a column where it is not SI, by the column's name")
    ] = {}
    wraps: Annotated[Names, Field(description="truths that are angles which jump by a turn, such as heading")] = ()
    separator: Annotated[str, Field(min_length=1, max_length=1, description="between the columns of a table")] = ","
    decimal: Annotated[Literal[".", ","], Field(description="decimal mark in a table")] = "."


def read_truth(cfg: LogTruthConfig | str) -> tuple[Truth, dict[str, object]]:
    """The truth in SI, and where it comes from (JSON values); a text is the path of an archive.

    Raises
    ------
    DataError
        The file cannot be read or trusted.
    ConfigError
        A table whose columns nobody names, a unit that is none, or for a column that is not read.
    """
    cfg = LogTruthConfig(file=cfg) if isinstance(cfg, str) else cfg
    path = Path(cfg.file)
    refuse_missing_file(path, "the truth")
    kind = cfg.format if cfg.format != "auto" else ("npz" if path.suffix.lower() == ".npz" else "csv")
    time_name, scale = cfg.time or _TIME[kind], _scale(cfg.time_unit, ("time_unit",))
    try:
        time, values = (_archive if kind == "npz" else _table)(path, cfg, time_name)
    except OSError as cause:
        raise DataError(f"cannot read the truth: {cause.strerror or cause}", location=Location(str(path))) from cause
    time = time * scale
    _refuse_disorder(path, time)
    for name in cfg.wraps:
        if name not in values:
            raise ConfigError(f"there is no truth {name!r}", hint=did_you_mean(name, values), within=("wraps",))
    facts: dict[str, object] = {"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    return Truth(time, values, "linear", frozenset(cfg.wraps)), facts


def _archive(path: Path, cfg: LogTruthConfig, time: str) -> tuple[FloatArray, dict[str, FloatArray]]:
    """All arrays by the names of the truths, or those that the config names."""
    chosen: Mapping[str, str | tuple[str, ...]] = cfg.columns or {
        truth_name(name): name for name in sorted(array_names(path) - {time})
    }
    arrays = read_arrays(path, tuple(dict.fromkeys((time, *_named(chosen)))))
    stamps = arrays[time]
    if stamps.ndim != 1 or not stamps.size:
        raise npz_fault(path, f"{time} has shape {stamps.shape}", "expected (N,) with a row or more")
    scales = _scales(cfg, chosen)
    return stamps, {
        name: arrays[own] * scales[own]
        if isinstance(own, str)
        else np.stack([arrays[column] * scales[column] for column in own], axis=-1)
        for name, own in chosen.items()
    }


def _table(path: Path, cfg: LogTruthConfig, time: str) -> tuple[FloatArray, dict[str, FloatArray]]:
    if not cfg.columns:
        raise ConfigError(
            "a table does not say which of its columns is which truth",
            hint="such as columns: {latitude: lat, velocity_t: [vel_east, vel_north]}",
            within=("columns",),
        )
    names, scales = _named(cfg.columns), _scales(cfg, cfg.columns)
    table, _ = read_columns(path, (time, *names), cfg.separator, cfg.decimal)
    place = {name: table[:, i] * scales[name] for i, name in enumerate(names, 1)}
    return table[:, 0], {
        name: place[own] if isinstance(own, str) else np.stack([place[column] for column in own], axis=-1)
        for name, own in cfg.columns.items()
    }


def _named(chosen: Mapping[str, str | tuple[str, ...]]) -> tuple[str, ...]:
    """The columns, each once."""
    return tuple(dict.fromkeys(c for own in chosen.values() for c in ((own,) if isinstance(own, str) else own)))


def _scales(cfg: LogTruthConfig, chosen: Mapping[str, str | tuple[str, ...]]) -> dict[str, float]:
    names = _named(chosen)
    for column in cfg.units:
        if column not in names:
            raise ConfigError(
                f"the truth has no column {column!r}", hint=did_you_mean(column, names), within=("units", column)
            )
    return {name: _scale(cfg.units.get(name, "1"), ("units", name)) for name in names}


def _scale(unit: str, within: tuple[str, ...]) -> float:
    try:
        return float(parse_unit(unit).scale)
    except ConfigError as error:
        error.within = within
        raise


def _refuse_disorder(path: Path, time: FloatArray) -> None:
    if not np.all(np.isfinite(time)):
        raise DataError("a row of the truth has no time", location=Location(str(path)))
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        k = int(back[0])
        raise DataError(
            f"the truth goes from {time[k]:.10g} s to {time[k + 1]:.10g} s: its instants have to grow",
            location=Location(str(path)),
        )
