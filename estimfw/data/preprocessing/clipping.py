"""Readings at the end of a sensor's range: the quantity may be anything beyond."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.data.preprocessing.rows import columns_of, count_of, ordered
from estimfw.data.record import Event, FloatArray, Stream

__all__ = ["Range", "clipped_readings", "without_clipped"]

Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Range:
    """Where a sensor clips.

    Attributes
    ----------
    lowest, highest : float or None
        Its range; a reading at an end of it or beyond is clipped.
    repeated : int or None
        Where the range is not known: the largest or smallest reading of a record, shown so many times in a row.
    rest : float or None
        What a sensor with nothing to show may repeat: 0 of a vehicle that stands.
    """

    lowest: float | None = None
    highest: float | None = None
    repeated: int | None = None
    rest: float | None = 0.0


def clipped_readings(values: FloatArray, limit: Range) -> Bools:
    """Which of the readings (N,) are clipped; one that is NaN is not."""
    clipped = np.zeros(values.size, dtype=bool)
    if limit.lowest is not None:
        clipped |= values <= limit.lowest
    if limit.highest is not None:
        clipped |= values >= limit.highest
    known = values[np.isfinite(values)]
    if limit.repeated is not None and known.size:
        for end in {float(known.min()), float(known.max())} - {limit.rest}:
            clipped |= _runs(values == end, limit.repeated)
    return clipped


def _runs(which: Bools, shortest: int) -> Bools:
    """The marked ones (N,) that stand in a run of so many or more."""
    edges = np.diff(np.concatenate([[False], which, [False]]).astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    long = ends - starts >= shortest
    found = np.zeros(which.size, dtype=bool)
    for start, end in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        found[start:end] = True
    return found


def without_clipped(
    stream: Stream, columns: tuple[str, ...], limit: Range, *, leave_out: bool
) -> tuple[Stream, tuple[Event, ...]]:
    """The stream with NaN for clipped readings (``leave_out``) or as it is, and an event for each column that has any.

    Raises
    ------
    DataError
        Rows out of order, or no such column.
    """
    raw, events = ordered(stream)
    values = raw.values.copy()
    for at in columns_of(raw, columns):
        lines = values[..., at].reshape(-1, len(raw))
        clipped = np.array([clipped_readings(line, limit) for line in lines])
        events += tuple(_told(raw, at, lines, clipped, "left out" if leave_out else "used as they are"))
        if leave_out:
            values[..., at] = np.where(clipped.reshape(values.shape[:-1]), np.nan, values[..., at])
    return replace(raw, values=values), events


def _told(stream: Stream, at: int, lines: FloatArray, clipped: Bools, done: str) -> Iterator[Event]:
    first, count = count_of(clipped)
    if count:
        shown = lines[int(np.argmax(clipped[:, first])), first]
        last = stream.time[clipped.shape[1] - 1 - int(np.argmax(clipped[:, ::-1].any(axis=0)))]
        text = (
            f"{stream.columns[at]} is at the end of its range, {shown:.6g}, from {stream.time[first]:.10g} s "
            f"(last at {last:.10g} s): readings {done}"
        )
        yield Event(float(stream.time[first]), stream.name, "clipped", text, count)
