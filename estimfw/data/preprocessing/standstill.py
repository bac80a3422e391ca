"""A sensor that shows one number for too long is not believed any more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimfw.data.preprocessing.rows import columns_of, count_of, ordered
from estimfw.data.record import Event, FloatArray, Stream

__all__ = ["stuck_readings", "without_stuck"]


def stuck_readings(time: FloatArray, values: FloatArray, longest: float, rest: float | None) -> NDArray[np.bool_]:
    """Readings (N,) that repeat the one before in a run of equal ones longer than ``longest`` s; ``rest`` may be repeated."""
    begins = np.concatenate([[True], values[1:] != values[:-1]])
    starts = np.flatnonzero(begins)
    ends = np.append(starts[1:], values.size) - 1
    stuck = (time[ends] - time[starts] > longest) & np.isfinite(values[starts])
    if rest is not None:
        stuck &= values[starts] != rest
    return np.asarray(np.repeat(stuck, ends - starts + 1) & ~begins)


def without_stuck(
    stream: Stream, columns: tuple[str, ...], longest: float, rest: float | None
) -> tuple[Stream, tuple[Event, ...]]:
    """The stream with NaN where a column is stuck, and an event for each that is.

    Parameters
    ----------
    stream : Stream
    columns : tuple of str
    longest : float, s
        A number may be shown that long.
    rest : float or None
        The number of a sensor that has nothing to show: 0 of a vehicle that stands.

    Raises
    ------
    DataError
        Rows out of order, or no such column.
    """
    raw, events = ordered(stream)
    values = raw.values.copy()
    for at in columns_of(raw, columns):
        lines = values[..., at].reshape(-1, len(raw))
        stuck = np.array([stuck_readings(raw.time, line, longest, rest) for line in lines])
        first, count = count_of(stuck)
        if count:
            shown = lines[int(np.argmax(stuck[:, first])), first]
            text = f"{raw.columns[at]} shows {shown:.6g} without change for more than {longest:g} s: not used"
            events += (Event(float(raw.time[first]), raw.name, "stuck", text, count),)
        values[..., at] = np.where(stuck.reshape(values.shape[:-1]), np.nan, values[..., at])
    return replace(raw, values=values), events
