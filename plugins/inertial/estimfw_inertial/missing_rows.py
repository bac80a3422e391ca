"""Gaps and missing numbers in a log of increments: found, flagged and, if wanted, bridged for a short while."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event
from estimfw.data.row_order import Rows
from estimfw.errors import DataError

__all__ = ["Missing", "bridged", "gap_events"]

FloatArray = NDArray[np.float64]
Missing = Literal["repeat", "keep"]

#: A step longer than this many periods is a gap.
_GAP = 1.5
#: A limit that is a multiple of the period is met by a hole of so many samples.
_ROUNDING = 1.0 + 1e-6


def gap_events(rows: Rows, period: float, longest: float) -> tuple[Event, ...]:
    """An event for every gap.

    Parameters
    ----------
    rows : Rows
        In order of time.
    period : float, s
    longest : float, s
        Of lost samples.

    Raises
    ------
    DataError
        A gap longer than ``longest`` s, with a guess at what made it.
    """
    step = np.diff(rows.time)
    places = np.flatnonzero(step > _GAP * period)
    for k in places[step[places] - period > longest * _ROUNDING]:
        raise DataError(
            f"a gap of {step[k]:.6g} s after {rows.time[k]:.10g} s, longer than the limit of {longest:g} s",
            location=rows.at(int(k) + 1),
            hint="cut the log there (`start`, `stop`), or raise `longest_gap`; if the clock jumped, correct the log",
        )
    return tuple(
        Event(
            float(rows.time[k]),
            "imu",
            "gap",
            f"{step[k]:.6g} s from one sample to the next",
            round(step[k] / period) - 1,
        )
        for k in places
    )


def bridged(rows: Rows, period: float, longest: float) -> tuple[Rows, tuple[Event, ...]]:
    """Rows without holes: lost samples come back as repetitions of the last good one.

    Parameters
    ----------
    rows : Rows
        In order of time.
    period : float, s
    longest : float, s
        How long a sample may be repeated.

    Raises
    ------
    DataError
        A longer hole, or one at the very start.
    """
    time, source = _grid(rows.time, period)
    values = np.where((source >= 0)[:, None], rows.values[source], np.nan)
    lost = np.isnan(values)
    if not lost.any():
        return rows, ()
    good = np.where(lost, -1, np.arange(time.size)[:, None])
    last = np.maximum.accumulate(good, axis=0)
    hole = np.arange(time.size)[:, None] - last
    _check_holes(rows, time, last, hole, period, longest)
    filled = np.take_along_axis(values, last, axis=0)
    lines = rows.lines[np.maximum.accumulate(source)] if rows.lines is not None else None
    count = int(np.count_nonzero(lost.any(axis=1)))
    first = float(time[np.argmax(lost.any(axis=1))])
    text = f"{count} samples lost or not numbers, the last good one repeated, first at {first:.10g} s"
    return Rows(rows.file, time, filled, lines), (Event(first, "imu", "repeated", text, count),)


def _check_holes(
    rows: Rows, time: FloatArray, last: NDArray[np.int64], hole: NDArray[np.int64], period: float, longest: float
) -> None:
    if np.any(last < 0):
        raise DataError(
            "the first samples are not numbers", location=rows.at(0), hint="begin later (`start` or `first_sample`)"
        )
    too_long = np.flatnonzero(hole.max(axis=1) * period > longest * _ROUNDING)
    if too_long.size:
        raise DataError(
            f"no good sample for more than {longest:g} s before {time[too_long[0]]:.10g} s",
            location=rows.at(int(np.searchsorted(rows.time, time[too_long[0]]))),
            hint="begin after it (`start`), raise `longest_gap`, or leave the holes in (`missing: keep`)",
        )


def _grid(time: FloatArray, period: float) -> tuple[FloatArray, NDArray[np.int64]]:
    """Time stamps with those of lost samples put in, and the row that each comes from (-1: lost)."""
    steps = np.maximum(1, np.round(np.diff(time) / period).astype(np.int64))
    places = np.concatenate([[0], np.cumsum(steps)])
    source = np.full(int(places[-1]) + 1, -1, dtype=np.int64)
    source[places] = np.arange(time.size)
    return np.interp(np.arange(source.size), places, time), source
