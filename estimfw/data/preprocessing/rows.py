"""Rows that preprocessing can work on: in the order of time, each instant once, at the rate that the stream says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME, Event, Record, Stream
from estimfw.data.row_order import known_jump
from estimfw.data.sampling import check_rate
from estimfw.errors import DataError
from estimfw.spelling import did_you_mean

__all__ = ["GAP", "columns_of", "count_of", "ordered", "period_of", "refuse_arrival", "stream_of"]

FloatArray = NDArray[np.float64]

#: A step longer than this many periods is a gap.
GAP = 1.5
#: A step of so many periods that is as long as a known jump of clocks is one.
_JUMP = 1000.0


def stream_of(record: Record, name: str) -> Stream:
    """A stream of a record; DataError with the nearest name if it is not there."""
    if name not in record.streams:
        raise DataError(f"the record has no stream {name!r}", hint=did_you_mean(name, record.streams))
    return record.streams[name]


def columns_of(stream: Stream, names: tuple[str, ...]) -> list[int]:
    """Where columns stand; DataError with the nearest name for one that is not there."""
    for name in names:
        if name not in stream.columns:
            raise DataError(f"stream {stream.name!r} has no column {name!r}", hint=did_you_mean(name, stream.columns))
    return [stream.columns.index(name) for name in names]


def ordered(stream: Stream) -> tuple[Stream, tuple[Event, ...]]:
    """The stream with identical rows of one instant once.

    Raises
    ------
    DataError
        No rows; a stamp that is no number; time that goes backwards; differing rows of one instant; a clock that jumped.
    """
    time, step = stream.time, np.diff(stream.time)
    if not time.size:
        raise DataError(f"stream {stream.name!r} has no rows")
    if not np.all(np.isfinite(time)):
        raise DataError(f"stream {stream.name!r}: row {int(np.argmin(np.isfinite(time))) + 1} has no time stamp")
    if np.any(step < -SAME):
        at = int(np.argmax(step < -SAME))
        raise DataError(
            f"stream {stream.name!r}: time goes backwards, from {time[at]:.10g} s to {time[at + 1]:.10g} s"
            f"{known_jump(float(step[at]))}",
            hint="sort the rows of the log, or drop the late ones (`time_errors` of a log)",
        )
    _refuse_jump(stream, step)
    same = np.concatenate([[False], step <= SAME])
    if not same.any():
        return stream, ()
    for k in np.flatnonzero(same):
        if not np.array_equal(stream.values[..., k, :], stream.values[..., k - 1, :], equal_nan=True):
            raise DataError(
                f"stream {stream.name!r}: two different rows have the time stamp {time[k]:.10g} s",
                hint="time stamps with too few digits, or two sensors in one stream?",
            )
    event = Event(
        float(time[np.argmax(same)]), stream.name, "duplicate", "identical rows are used once", int(same.sum())
    )
    arrival = stream.arrival[~same] if stream.arrival is not None else None
    return replace(stream, time=time[~same], values=stream.values[..., ~same, :], arrival=arrival), (event,)


def _refuse_jump(stream: Stream, step: FloatArray) -> None:
    if not step.size:
        return
    at, typical = int(np.argmax(step)), float(np.median(step))
    guess = known_jump(float(step[at]))
    if guess and step[at] > _JUMP * typical > 0.0:
        raise DataError(
            f"stream {stream.name!r}: the time jumps from {stream.time[at]:.10g} s to {stream.time[at + 1]:.10g} s{guess}",
            hint="correct the log, or cut it there",
        )


def refuse_arrival(stream: Stream, done: str) -> None:
    """DataError where rows that say when they arrived are to be made into others, of which nobody knows that."""
    if stream.arrival is not None:
        raise DataError(
            f"the rows of stream {stream.name!r} say when they arrived; they cannot be {done}",
            hint="leave `arrival` out of the log, and all rows count as in time",
        )


def period_of(stream: Stream, rate: float | None = None) -> float:
    """The sampling interval in s: of ``rate`` (Hz), else what the stream says, else the median step of its stamps.

    Raises
    ------
    DataError
        The stamps show another one, or there is but one row.
    """
    nominal = 1.0 / rate if rate is not None else stream.period
    if len(stream) < 2 and nominal is None:
        raise DataError(f"stream {stream.name!r} has one row and says no rate")
    if nominal is None:
        return float(np.median(np.diff(stream.time)))
    try:
        check_rate(stream.time, nominal)
    except DataError as error:
        error.message = f"stream {stream.name!r}: {error.message}"
        raise
    return nominal


def count_of(which: NDArray[np.bool_]) -> tuple[int, int]:
    """First row (-1: none) and number of the marked readings (..., N), over all runs."""
    rows = which.reshape(-1, which.shape[-1])
    marked = rows.any(axis=0)
    return (int(np.argmax(marked)) if marked.any() else -1), int(rows.sum())
