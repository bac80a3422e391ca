"""Readings that the last good one cannot have become: wheel slip, a dead or a disturbed sensor."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.data.preprocessing.rows import columns_of, count_of, ordered, period_of
from estimfw.data.record import Event, FloatArray, Stream

__all__ = ["JumpLimit", "impossible", "without_jumps"]

Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class JumpLimit:
    """What a reading can become.

    Attributes
    ----------
    rate : float
        Largest rate of change, per s.
    tolerance : float
        By which a reading may be off without any change.
    window : float, s
        Readings are averaged over it before they are judged: coarse ones.
    longest : float, s
        A jump and a jump back that are no farther apart enclose readings of which none is good.
    period : float or None
        After which the reading begins anew: a heading that goes from 359 deg to 1 deg has changed by 2 deg. None: never.
    """

    rate: float
    tolerance: float = 0.0
    window: float = 0.0
    longest: float = 0.0
    period: float | None = None

    def change(self, difference: FloatArray) -> FloatArray:
        """What a difference of two readings (N,) is: the shorter way round where they begin anew."""
        if self.period is None:
            return difference
        return np.asarray(difference - self.period * np.round(difference / self.period))


def impossible(time: FloatArray, values: FloatArray, limit: JumpLimit, period: float) -> Bools:
    """Which of the readings (N,) at ``time`` (N,) s are not good; one that is NaN is not judged.

    Notes
    -----
    After a step of more than rate dt + tolerance, with r the reading before it, readings are bad until one is there that r can
    have become: within rate (t - t_r) + tolerance of it. That range widens with time, so that a lasting change is believed in
    the end. With ``longest``, all are bad up to a step back within that time. With ``window`` the steps are those between means
    over neighbouring windows, and what is left out is up to a window longer at either end than what is bad.
    """
    bad = np.zeros(time.size, dtype=bool)
    rows = np.flatnonzero(np.isfinite(values))
    lag = max(1, round(limit.window / period))
    if rows.size <= lag:
        return bad
    read = values[rows]
    if limit.period is not None and rows.size > 1:
        read = np.cumsum(np.concatenate([read[:1], limit.change(np.diff(read))]))
    t, x = time[rows], _averaged(read, lag)
    step = np.concatenate([np.zeros(lag), limit.change(x[lag:] - x[:-lag])])
    jumps = np.flatnonzero(np.abs(step[lag:]) > limit.rate * (t[lag:] - t[:-lag]) + limit.tolerance) + lag
    done = 0
    for k in jumps.tolist():
        if k - lag < done:  # a step from a bad reading is none
            continue
        good = np.abs(limit.change(x - x[k - lag])) <= limit.rate * (t - t[k - lag]) + limit.tolerance
        reachable = good[k:]
        done = k + int(np.argmax(reachable)) if reachable.any() else x.size
        back = jumps[(jumps > k) & (t[jumps] - t[k] <= limit.longest) & (step[jumps] * step[k] < 0.0)]
        done = max(done, _end_of_run(back, good[back]) - lag // 2)
        bad[rows[k - lag // 2 : done]] = True
    return bad


def _end_of_run(rows: NDArray[np.int64], good: Bools) -> int:
    """The last of the neighbouring rows that begin with the first good one; 0 if none is good."""
    if not good.any():
        return 0
    run = rows[int(np.argmax(good)) :]
    return int(run[np.flatnonzero(run - run[0] == np.arange(run.size))[-1]])


def _averaged(x: FloatArray, width: int) -> FloatArray:
    """Mean of so many readings around each; at the ends that of the first and last so many."""
    width = min(width, x.size)
    if width == 1:
        return x
    total = np.concatenate([[0.0], np.cumsum(x - x[0])])
    first = np.clip(np.arange(x.size) - width // 2, 0, x.size - width)
    return np.asarray(x[0] + (total[first + width] - total[first]) / width)


def without_jumps(
    stream: Stream, columns: tuple[str, ...], limit: JumpLimit, unit: str
) -> tuple[Stream, tuple[Event, ...]]:
    """The stream with NaN for readings that are not good, and an event for each column that has any.

    Parameters
    ----------
    stream : Stream
    columns : tuple of str
    limit : JumpLimit
    unit : str
        Of the rate, for people.

    Raises
    ------
    DataError
        Rows out of order, or no such column.
    """
    raw, events = ordered(stream)
    period, values = period_of(raw) if len(raw) > 1 else 1.0, raw.values.copy()
    for at in columns_of(raw, columns):
        lines = values[..., at].reshape(-1, len(raw))
        bad = np.array([impossible(raw.time, line, limit, period) for line in lines])
        values[..., at] = np.where(bad.reshape(values.shape[:-1]), np.nan, values[..., at])
        events += tuple(_told(raw, raw.columns[at], bad, limit, unit))
    return replace(raw, values=values), events


def _told(stream: Stream, column: str, bad: Bools, limit: JumpLimit, unit: str) -> Iterator[Event]:
    first, count = count_of(bad)
    if count:
        text = f"{column} changes faster than {limit.rate:g} {unit}: readings that cannot be are left out"
        yield Event(float(stream.time[first]), stream.name, "jump", text, count)
