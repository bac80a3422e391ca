"""All streams merged into steps: intervals, the rows due at their ends, and what was wrong with them.

Two ways to make steps. A provider that reads a stream (an IMU) makes one of every so many rows of it; measurement rows fall
due at the end of the step in which they lie. Without one, steps end where any stream, schedule or pseudo-measurement has an
instant. Gaps, duplicates, rows before the start and rows too many are decided here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.data.arrivals import Arrivals, arrivals_of
from estimfw.data.memory import refuse_too_large
from estimfw.data.record import SAME, Event, Stream
from estimfw.errors import DataError

__all__ = ["Due", "Steps", "Wanted", "driven_steps", "merged_steps"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a measurement wants of the timeline: rows of a stream, or a pseudo-measurement every so many s (None: each step)."""

    name: str
    stream: str | None
    every: float | None = None


@dataclass(frozen=True, slots=True)
class Due:
    """For each step the stream row that is due at its end (-1: none; 0 for a pseudo-measurement), and its interval in s.

    ``late`` (K,): a row was due and came too late, so there is none; None: no row came late.
    """

    row: IntArray
    interval: FloatArray
    late: NDArray[np.bool_] | None = None

    def take(self, which: NDArray[np.bool_]) -> Due:
        """That of some steps."""
        return Due(self.row[which], self.interval[which], self.late[which] if self.late is not None else None)


@dataclass(frozen=True, slots=True)
class Steps:
    """The timeline.

    Attributes
    ----------
    start : float, s
    time : (K,) array, s
        Ends of the steps.
    dt : (K,) array, s
        Equal steps are equal to the last bit, so that they share their matrices.
    rows : (K + 1,) array
        Step k uses rows ``rows[k]:rows[k + 1]`` of the driving stream.
    due : mapping of measurement name to Due
    restart : (K,) bool array
        Start the filter anew before this step.
    events : tuple of Event
    """

    start: float
    time: FloatArray
    dt: FloatArray
    rows: IntArray
    due: Mapping[str, Due]
    restart: NDArray[np.bool_]
    events: tuple[Event, ...]

    def __len__(self) -> int:
        return int(self.time.shape[0])

    @property
    def begin(self) -> FloatArray:
        """Beginnings of the steps (K,), s; that of the first is ``start`` itself, where time less dt is it but for rounding."""
        begin = self.time - self.dt
        begin[:1] = self.start
        return begin


def driven_steps(
    driver: Stream,
    per_step: int,
    streams: Mapping[str, Stream],
    wanted: Sequence[Wanted],
    *,
    start: float | None = None,
    restarts: Sequence[float] = (),
    replay: float = 0.0,
) -> Steps:
    """Steps of ``per_step`` rows of a driving stream.

    Parameters
    ----------
    driver : Stream
        Stamps at the ends of its intervals; rows at or before ``start`` are not used.
    start : float or None, s
        None: the beginning of its first interval.
    replay : float, s
        Rows that arrive late are used if the filter need not go back farther.

    Raises
    ------
    DataError
        Fewer rows than one step needs.
    """
    period = driver.period if driver.period is not None else _typical(driver.time)
    first = int(np.searchsorted(driver.time, start + 0.5 * period)) if start is not None else 0
    count = (len(driver) - first) // per_step
    if count <= 0:
        raise DataError(
            f"stream {driver.name!r} has {len(driver) - first} rows after the start, one step needs {per_step}",
            hint="the record is empty, or too short for the alignment before it",
        )
    rows = first + per_step * np.arange(count + 1, dtype=np.int64)
    time = driver.time[rows[1:] - 1]
    begin = _begun(float(driver.time[first]), period) if start is None else float(start)
    dt = _snapped(np.diff(np.concatenate([[begin], time])), per_step * period)
    events = (*_left_over(driver, len(driver) - int(rows[-1])), *_missing_steps(driver, time, dt, per_step * period))
    arrivals = arrivals_of(_measured(streams, wanted), [driver], time, replay)
    due, found = _dues(time, dt, begin, streams, wanted, arrivals)
    return Steps(begin, time, dt, rows, due, _restarts(time, dt, restarts), (*events, *found))


def merged_steps(
    streams: Mapping[str, Stream],
    wanted: Sequence[Wanted],
    *,
    instants: Sequence[float] = (),
    start: float | None = None,
    stop: float | None = None,
    restarts: Sequence[float] = (),
    replay: float = 0.0,
) -> Steps:
    """Steps between the instants of all streams that are wanted, of pseudo-measurements, schedules and restarts.

    They begin with the first row and end with the last one, where ``start`` and ``stop`` do not say it. Rows that arrive late are
    used if the filter need not go back farther than ``replay`` s.

    Raises
    ------
    DataError
        There is no instant at all.
    """
    rows = np.concatenate([*(_stream(streams, w.name, w.stream).time for w in wanted if w.stream), np.zeros(0)])
    between = np.concatenate([np.asarray(instants, dtype=float), np.asarray(restarts, dtype=float)])
    if not rows.size and not between.size and stop is None:
        raise DataError("the record has no rows", hint="no measurement stream holds any data")
    begin = float(start) if start is not None else float(np.min(rows)) if rows.size else 0.0
    end = float(stop) if stop is not None else float(np.max(rows if rows.size else between))
    _refuse_too_many(wanted, end - begin)
    ticks = [begin + w.every * np.arange(1, int((end - begin) / w.every + 1e-9) + 1) for w in wanted if w.every]
    known = np.concatenate([rows, between[between > begin + SAME]])
    every = np.unique(np.concatenate([known, *ticks]))
    every = every[(every >= begin - SAME) & (every <= end + SAME)]
    if not every.size:
        raise DataError(f"no instant lies between the start {begin:g} s and the end {end:g} s")
    time = every[np.concatenate([[True], np.diff(every) > SAME])]
    dt = np.diff(np.concatenate([[begin], time]))
    dt = _snapped(np.where(dt < SAME, 0.0, dt), _typical(time))
    measured = _measured(streams, wanted)
    arrivals = arrivals_of(measured, measured, time, replay)
    due, events = _dues(time, dt, begin, streams, wanted, arrivals)
    none = np.zeros(time.size + 1, dtype=np.int64)
    return Steps(begin, time, dt, none, due, _restarts(time, dt, restarts), tuple(events))


def _refuse_too_many(wanted: Sequence[Wanted], duration: float) -> None:
    for w in wanted:
        if w.every:
            count = duration / w.every
            text = f"measurement {w.name!r}, every {w.every:g} s over {duration:g} s: {count:.3g} steps"
            refuse_too_large(8.0 * 20.0 * count, text, "let it fall due less often")


def _begun(first: float, period: float) -> float:
    """Beginning of the first interval, from its end; zero where it is zero but for rounding of the stamps."""
    return 0.0 if abs(first - period) <= 1e-6 * period else first - period


def _typical(time: FloatArray) -> float:
    return float(np.median(np.diff(time))) if time.size > 1 else 1.0


def _snapped(dt: FloatArray, nominal: float) -> FloatArray:
    """Steps that differ from the nominal one by rounding of the stamps become the nominal one."""
    near = np.abs(dt - nominal) <= 1e-6 * nominal
    dt = np.where(near, nominal, dt)
    known, inverse = np.unique(np.round(dt, 9), return_inverse=True)
    first = np.array([dt[np.argmax(inverse == k)] for k in range(known.size)])
    return np.asarray(first[inverse], dtype=float)


def _missing_steps(driver: Stream, time: FloatArray, dt: FloatArray, period: float) -> tuple[Event, ...]:
    """Of a driver of samples, which a longer step bridges; what becomes of missing increments is for their source to say."""
    gaps = dt > 1.5 * period
    if driver.kind != "sample" or not np.any(gaps):
        return ()
    at, longest = int(np.argmax(gaps)), float(np.max(dt))
    text = f"steps longer than 1.5 x {period:g} s, up to {longest:g} s: rows are missing, one step bridges them"
    return (Event(float(time[at] - dt[at]), driver.name, "gap", text, int(gaps.sum())),)


def _left_over(driver: Stream, rows: int) -> tuple[Event, ...]:
    if rows == 0:
        return ()
    text = f"{rows} row{'s' if rows > 1 else ''} at the end: less than a step, not used"
    return (Event(float(driver.time[-1]), driver.name, "left over", text, rows),)


def _restarts(time: FloatArray, dt: FloatArray, restarts: Sequence[float]) -> NDArray[np.bool_]:
    flags = np.zeros(time.size, dtype=bool)
    for instant in restarts:
        k = int(np.searchsorted(time - dt, instant - SAME))
        if 0 < k < time.size:
            flags[k] = True
    return flags


def _dues(
    time: FloatArray,
    dt: FloatArray,
    begin: float,
    streams: Mapping[str, Stream],
    wanted: Sequence[Wanted],
    arrivals: Arrivals | None,
) -> tuple[dict[str, Due], list[Event]]:
    due: dict[str, Due] = {}
    events: list[Event] = []
    for w in wanted:
        if w.stream is None:
            due[w.name] = _pseudo(time, dt, begin, w.every)
        else:
            due[w.name], found = _stream_due(time, begin, _stream(streams, w.name, w.stream), w.name, arrivals)
            events.extend(found)
    return due, events


def _measured(streams: Mapping[str, Stream], wanted: Sequence[Wanted]) -> list[Stream]:
    """The streams that are read, each once."""
    return [_stream(streams, name, stream) for stream, name in {w.stream: w.name for w in wanted if w.stream}.items()]


def _stream(streams: Mapping[str, Stream], name: str, wanted: str) -> Stream:
    """The stream of a measurement; DataError if it is not there, or its time is no time."""
    if wanted not in streams:
        raise DataError(
            f"measurement {name!r} needs the stream {wanted!r}, which the source does not have",
            hint=_other_streams(sorted(streams)),
        )
    time = streams[wanted].time
    if not np.all(np.isfinite(time)):
        at = int(np.argmin(np.isfinite(time)))
        raise DataError(f"stream {wanted!r}: the time of row {at + 1} is {time[at]:g}", hint="drop the row")
    if np.any(np.diff(time) < 0.0):
        at = int(np.argmax(np.diff(time) < 0.0)) + 1
        raise DataError(
            f"stream {wanted!r}: time goes backwards at row {at + 1}: {time[at]:g} s after {time[at - 1]:g} s",
            hint="sort the rows, or drop those that are late",
        )
    return streams[wanted]


def _other_streams(names: list[str]) -> str:
    if not names:
        return "it has: none"
    says = f"`stream: {names[0]}`" if len(names) == 1 else "`stream:` and one of these"
    return f"it has: {', '.join(names)}; if the readings are there, give the measurement {says}"


def _pseudo(time: FloatArray, dt: FloatArray, begin: float, every: float | None) -> Due:
    if every is None:
        return Due(np.zeros(time.size, dtype=np.int64), np.where(dt > 0.0, dt, _typical(time)))
    count = np.floor((time - begin) / every + 1e-6)
    fresh = np.diff(np.concatenate([[0.0], count])) > 0
    return Due(np.where(fresh, 0, -1).astype(np.int64), np.full(time.size, every))


def _stream_due(
    time: FloatArray, begin: float, stream: Stream, name: str, arrivals: Arrivals | None
) -> tuple[Due, list[Event]]:
    events: list[Event] = []
    if not len(stream):
        events.append(Event(float("nan"), name, "no rows", "the stream is empty: nothing of it is fused"))
    keep = _without_duplicates(stream, events)
    period = stream.period or _typical(stream.time[keep])
    row = np.full(time.size, -1, dtype=np.int64)
    interval = np.full(time.size, period)
    step = np.searchsorted(time, stream.time[keep] - SAME)
    early = stream.time[keep] < begin - SAME
    if np.any(early):
        first = float(stream.time[keep][0])
        events.append(Event(first, name, "before start", "rows before the start are not used", int(early.sum())))
    after = step >= time.size
    if np.any(after):
        last = float(stream.time[keep][-1])
        events.append(Event(last, name, "after end", "rows after the last step are not used", int(after.sum())))
    usable, late = ~early & ~after, None
    if arrivals is not None and stream.arrival is not None:
        at = np.flatnonzero(usable)
        passed, too_late, by = arrivals.judged(stream, keep[at], step[at])
        events.extend(arrivals.told(name, stream.time[keep[at]], passed, too_late, by))
        usable[at[too_late]], late = False, np.zeros(time.size, dtype=bool)
        late[step[at[too_late]]] = True
    row[step[usable]] = keep[usable]
    crowded = int(usable.sum()) - int(np.count_nonzero(row >= 0))
    if crowded:
        text = "more than one row in a step: the last one is used"
        events.append(Event(float(time[step[usable][0]]), name, "crowded", text, crowded))
    gaps = np.diff(stream.time[keep]) > 1.5 * period
    if stream.period is not None and np.any(gaps):
        before = float(stream.time[keep][int(np.argmax(gaps))])
        events.append(
            Event(before, name, "gap", f"gaps longer than 1.5 x {period:g} s; the filter coasts", int(gaps.sum()))
        )
    return Due(row, interval, late & (row < 0) if late is not None else None), events


def _without_duplicates(stream: Stream, events: list[Event]) -> IntArray:
    same = np.concatenate([np.zeros(min(1, len(stream)), dtype=bool), np.diff(stream.time) <= SAME])
    for k in np.flatnonzero(same):
        if not np.array_equal(stream.values[k], stream.values[k - 1], equal_nan=True):
            raise DataError(
                f"stream {stream.name!r}: rows {k} and {k + 1} have one time, {stream.time[k]:g} s, but differ",
                hint="the log holds two sensors, or its time has too few digits",
            )
    if np.any(same):
        at = float(stream.time[int(np.argmax(same))])
        events.append(Event(at, stream.name, "duplicate", "identical rows are used once", int(same.sum())))
    return np.flatnonzero(~same).astype(np.int64)
