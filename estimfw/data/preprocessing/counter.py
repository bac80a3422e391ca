"""Pulse counts turned into speeds or distances: wrapped, reset, jumped and missing counts are found and told.

A counter says nothing but a number. What it did since the reading before follows from what the vehicle can do: at most
``fastest`` scaled counts a second, and one more for the rounding to whole pulses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.data.preprocessing.rows import GAP, columns_of, count_of, ordered, period_of
from estimfw.data.record import Event, FloatArray, Stream
from estimfw.errors import DataError

__all__ = ["KINDS", "TOLD", "Counter", "Increments", "counted", "fits", "increments", "moved"]

Bools = NDArray[np.bool_]
Output = Literal["rate", "increment", "count"]

#: Of the stream that an output makes.
KINDS: dict[Output, Literal["increment", "mean", "sample"]] = {
    "rate": "mean",
    "increment": "increment",
    "count": "sample",
}

#: By the kind of an event what is told.
TOLD = {
    "missing": "counts are missing: their pulses show in the next one",
    "spike": "single counts fit neither the one before nor the one after them: left out",
    "wrap": "the counter wrapped: unwrapped",
    "reset": "the counter was reset: the pulses of that interval are not known",
    "jump": "the counter jumped by more than is possible: the pulses of that interval are not known",
    "ambiguous": "after so long without a count the counter may have wrapped more than once: those pulses are not known",
}


@dataclass(frozen=True, slots=True)
class Counter:
    """How counts are made.

    Attributes
    ----------
    scale : float
        Of one count, such as 0.04 m.
    modulus : float or None
        A counter of 16 bits goes from 65535 to 0: 65536.
    fastest : float or None
        Largest size of the rate, scaled: m/s.
    both : bool
        It counts down as well.
    rate : float or None, Hz
        That the stamps must show.
    """

    scale: float
    modulus: float | None = None
    fastest: float | None = None
    both: bool = False
    rate: float | None = None


@dataclass(frozen=True, slots=True)
class Increments:
    """Of N readings.

    Attributes
    ----------
    counts : (N,) array
        Counts since the good reading before; NaN where there is no count, or nobody knows.
    elapsed : (N,) array, s
        Since the good reading before.
    total : (N,) array
        The count without wraps and resets, from the first good reading on; NaN where there is none. What is not known is left
        out of it.
    flags : mapping of kind to (N,) bool array
    """

    counts: FloatArray
    elapsed: FloatArray
    total: FloatArray
    flags: dict[str, Bools]


def increments(time: FloatArray, counts: FloatArray, counter: Counter) -> Increments:
    """What a counter did between its readings (N,) at ``time`` (N,) s; NaN is no reading."""
    good = np.isfinite(counts)
    flags = {"missing": ~good}
    spikes = _spikes(time, counts, np.flatnonzero(good), counter)
    good = good & ~spikes
    flags["spike"] = spikes
    rows = np.flatnonzero(good)
    step, elapsed, found = _steps(time[rows], counts[rows], counter)
    for kind, which in found.items():
        flags[kind] = np.zeros(time.size, dtype=bool)
        flags[kind][rows[1:][which]] = True
    known = _known(step, counts[rows[1:]], elapsed, found["reset"], counter)
    total = counts[rows[:1]].sum() + np.concatenate([[0.0], np.cumsum(known)])
    whole = [np.full(time.size, np.nan) for _ in range(3)]
    whole[0][rows[1:]], whole[1][rows[1:]], whole[2][rows] = step, elapsed, total[: rows.size]
    return Increments(whole[0], whole[1], whole[2], flags)


def fits(one: tuple[float, float], other: tuple[float, float], counter: Counter) -> bool:
    """Whether a reading (time, count) can follow another one."""
    return bool(np.isfinite(moved(one, other, counter)[0]))


def moved(one: tuple[float, float], other: tuple[float, float], counter: Counter) -> tuple[float, float, str]:
    """Counts from a reading (time, count) to a later one, NaN if nobody knows; what of them is known; what was wrong."""
    time, counts = np.array([one[0], other[0]]), np.array([one[1], other[1]])
    step, elapsed, found = _steps(time, counts, counter)
    known = _known(step, counts[1:], elapsed, found["reset"], counter)
    return float(step[0]), float(known[0]), next((kind for kind, which in found.items() if which[0]), "")


def _known(step: FloatArray, counts: FloatArray, elapsed: FloatArray, reset: Bools, counter: Counter) -> FloatArray:
    """Counts that are sure: after a reset those since then."""
    begun = np.where(reset & (counts <= _most(elapsed, counter)), counts, 0.0)
    return np.where(np.isfinite(step), step, begun)


def _most(elapsed: FloatArray, counter: Counter) -> FloatArray:
    """Counts that are possible within so many s."""
    if counter.fastest is None:
        return np.full(elapsed.shape, np.inf)
    return counter.fastest / abs(counter.scale) * elapsed + 1.0


def _steps(time: FloatArray, counts: FloatArray, counter: Counter) -> tuple[FloatArray, FloatArray, dict[str, Bools]]:
    """Counts (N - 1,) from one reading to the next, the time between them in s, and what was wrong with them."""
    moved, elapsed = np.diff(counts), np.diff(time)
    most, step, other = _most(elapsed, counter), moved, np.full(moved.shape, np.inf)
    if counter.modulus is not None:
        half = 0.5 * counter.modulus if counter.both else 0.0
        step = (moved + half) % counter.modulus - half
        other = counter.modulus - np.abs(step) if counter.both else counter.modulus + step
    possible = (np.abs(step) <= most) & (counter.both | (step >= 0.0))
    ambiguous = possible & np.isfinite(other) & (other <= most)
    reset = ~possible & (moved < 0.0) & (not counter.both)
    found = {
        "wrap": possible & ~ambiguous & (step != moved),
        "reset": reset,
        "jump": ~possible & ~reset,
        "ambiguous": ambiguous,
    }
    return np.where(possible & ~ambiguous, step, np.nan), elapsed, found


def _spikes(time: FloatArray, counts: FloatArray, rows: NDArray[np.int64], counter: Counter) -> Bools:
    """Readings that are impossible after the one before and before the one after, which fit each other."""
    spikes = np.zeros(time.size, dtype=bool)
    if rows.size < 3:
        return spikes
    single = np.isfinite(_steps(time[rows], counts[rows], counter)[0])
    across = np.full(rows.size - 2, False)
    for first in (0, 1):  # every other reading: two sequences
        across[first::2] = np.isfinite(_steps(time[rows[first::2]], counts[rows[first::2]], counter)[0])
    spikes[rows[1:-1]] = ~single[:-1] & ~single[1:] & across
    return spikes


def counted(
    stream: Stream, columns: dict[str, str], counter: Counter, output: Output, into: str
) -> tuple[Stream, tuple[Event, ...]]:
    """A stream of what was counted.

    Parameters
    ----------
    stream : Stream
        Of counts, whole numbers; NaN where there is none.
    columns : dict of str to str
        Columns of counts, and what they are called in the result, which has no others.
    counter : Counter
    output : 'rate', 'increment' or 'count'
        The mean rate over the interval since the count before (scale / s), the increment over it, or the count without wraps
        and resets, scaled. The first row has no interval: it is left out but of ``count``. After missing counts there is no
        rate: the mean over more than an interval is none at its place.
    into : str
        Name of the result.

    Raises
    ------
    DataError
        Rows out of order or at another rate, or numbers that are no counts.
    """
    raw, events = ordered(stream)
    period = period_of(raw, counter.rate)
    events += _gaps(raw, period)
    values = raw.values[..., columns_of(raw, tuple(columns))]
    for i, column in enumerate(columns):
        _refuse_no_counts(raw, column, values[..., i])
    lines = np.moveaxis(values, -2, -1)
    flat = [increments(raw.time, line, counter) for line in lines.reshape(-1, len(raw))]
    made = np.array([_output(one, output, period) for one in flat]).reshape(lines.shape) * counter.scale
    for i, column in enumerate(columns):
        events += tuple(_events(raw, column, flat[i :: len(columns)]))
    first = 0 if output == "count" else 1
    result = replace(
        raw,
        name=into,
        time=raw.time[first:],
        values=np.moveaxis(made, -1, -2)[..., first:, :],
        columns=tuple(columns.values()),
        kind=KINDS[output],
        period=period,
        arrival=_arrival(raw.arrival, first),
    )
    return result, events


def _arrival(arrival: FloatArray | None, first: int) -> FloatArray | None:
    """What is made of two counts is known when both are there."""
    if arrival is None or not first:
        return arrival
    return np.maximum(arrival[1:], arrival[:-1])


def _output(one: Increments, output: str, period: float) -> FloatArray:
    if output == "count":
        return one.total
    if output == "increment":
        return one.counts
    return np.where(one.elapsed > GAP * period, np.nan, one.counts / one.elapsed)


def _refuse_no_counts(stream: Stream, column: str, values: FloatArray) -> None:
    broken = np.isfinite(values) & (values != np.round(values))
    first, _ = count_of(broken)
    if first >= 0:
        value = values[..., first].reshape(-1)[int(np.argmax(broken[..., first].reshape(-1)))]
        raise DataError(
            f"stream {stream.name!r}: {column} is {value:.10g} at {stream.time[first]:.10g} s, which is no count of pulses",
            hint="a counter shows whole numbers; a speed or a distance needs no counter",
        )


def _gaps(stream: Stream, period: float) -> tuple[Event, ...]:
    step = np.diff(stream.time)
    gaps = step > GAP * period
    if not gaps.any():
        return ()
    lost = int(np.sum(np.round(step[gaps] / period) - 1.0))
    text = f"gaps of up to {float(step.max()):.6g} s: over each there is but one count"
    return (Event(float(stream.time[int(np.argmax(gaps))]), stream.name, "gap", text, lost),)


def _events(stream: Stream, column: str, found: list[Increments]) -> Iterator[Event]:
    for kind, text in TOLD.items():
        first, count = count_of(np.array([one.flags[kind] for one in found]))
        if count:
            yield Event(float(stream.time[first]), stream.name, kind, f"{column}: {text}", count)
