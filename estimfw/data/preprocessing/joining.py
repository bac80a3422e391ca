"""Columns of one stream put onto the stamps of another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.data.preprocessing.rows import GAP, columns_of, count_of, ordered, period_of, refuse_arrival
from estimfw.data.record import SAME, Event, FloatArray, Stream
from estimfw.data.row_order import jump_near, known_jump
from estimfw.errors import DataError

__all__ = ["METHODS", "Joining", "Method", "joined", "refused_hole"]

Method = Literal["linear", "last", "difference", "rate"]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Joining:
    """How readings are taken at other instants.

    Attributes
    ----------
    method : 'linear', 'last', 'difference' or 'rate'
        On a straight line between the readings (means over intervals stand in their middle); the last one that was complete; what
        a cumulative column gained over the interval of each row, as it is or by time.
    longest_gap : float or None, s
        Readings are trusted that far from one to the next (``last``: that long). None: 1.5 sampling intervals.
    missing : 'empty' or 'refuse'
        What becomes of rows over longer ones.
    """

    method: Method = "linear"
    longest_gap: float | None = None
    missing: Literal["empty", "refuse"] = "empty"


def joined(
    target: Stream, source: Stream, columns: dict[str, str], joining: Joining
) -> tuple[Stream, tuple[Event, ...]]:
    """The target with more columns, cut to the instants at which the source has readings.

    Parameters
    ----------
    target, source : Stream
    columns : dict of str to str
        Columns of the source, and what they are called in the target.
    joining : Joining

    Raises
    ------
    DataError
        No common time, with a guess at the offset of the clocks; a column that the target has already, or the source has not;
        increments, which cannot be taken at other instants; missing readings that are refused.

    Notes
    -----
    Rows are cut by stamps alone. Where readings are missing the column is NaN, and an event says how often.
    """
    refuse_arrival(source, "joined onto another stream")
    target, events = ordered(target)
    source, more = ordered(source)
    taken = [name for name in columns.values() if name in target.columns]
    if taken:
        raise DataError(f"stream {target.name!r} has a column {taken[0]!r} already", hint="give it another name")
    if source.kind == "increment":
        raise DataError(
            f"stream {source.name!r} holds increments over its own intervals: they are none over those of {target.name!r}",
            hint="join a rate, or the difference of a count",
        )
    at, period = columns_of(source, tuple(columns)), period_of(source)
    known = source.time - (0.5 * period if source.kind == "mean" and joining.method == "linear" else 0.0)
    reach = joining.longest_gap if joining.longest_gap is not None else GAP * period
    inside = _inside(target, known, joining.method, reach)
    if not inside.any():
        raise _apart(target, source)
    begin = _begins(target)
    take = METHODS[joining.method]
    lead = np.broadcast_shapes(target.values.shape[:-2], source.values.shape[:-2])
    lines = np.broadcast_to(np.moveaxis(source.values[..., at], -2, -1), (*lead, len(at), len(source)))
    made, bridged = (
        np.array(x).reshape(*lead, len(at), -1)
        for x in zip(
            *(
                take(begin[inside], target.time[inside], known, line, reach, period)
                for line in lines.reshape(-1, len(source))
            ),
            strict=True,
        )
    )
    rows = np.broadcast_to(target.values[..., inside, :], (*lead, int(inside.sum()), len(target.columns)))
    values = np.concatenate([rows, np.moveaxis(made, -1, -2)], axis=-1)
    arrival = target.arrival[inside] if target.arrival is not None else None
    columns_made = (*target.columns, *columns.values())
    result = replace(target, time=target.time[inside], values=values, columns=columns_made, arrival=arrival)
    told = (*_cut(target, source, inside), *_readings(result, source, made, bridged))
    if joining.missing == "refuse" and np.isnan(made).any():
        raise refused_hole(source.name, float(result.time[count_of(np.isnan(made))[0]]), reach)
    return result, (*events, *(e for e in more if e not in events), *told)


def _begins(target: Stream) -> FloatArray:
    """Where the interval of each row begins: at the stamp before; of the first one, and after a gap, a period earlier."""
    period = period_of(target) if len(target) > 1 or target.period is not None else 0.0
    before = np.concatenate([[-np.inf], target.time[:-1]])
    return np.where(target.time - before > GAP * period, target.time - period, before)


def _inside(target: Stream, known: FloatArray, method: Method, reach: float) -> Bools:
    first = _begins(target) if method in ("difference", "rate") else target.time
    end = known[-1] + (reach if method == "last" else 0.0)
    return np.asarray((first >= known[0] - SAME) & (target.time <= end + SAME))


def _linear(
    begin: FloatArray, time: FloatArray, known: FloatArray, values: FloatArray, reach: float, period: float
) -> tuple[FloatArray, Bools]:
    """Readings at ``time``, and which of them stand in a gap that was bridged."""
    del begin
    good = np.isfinite(values)
    t, x = known[good], values[good]
    if not t.size:
        return np.full(time.shape, np.nan), np.zeros(time.shape, dtype=bool)
    after = np.minimum(np.searchsorted(t, time - SAME), t.size - 1)
    before = np.maximum(after - 1, 0)
    hit = np.abs(t[after] - time) <= SAME
    width = np.where(hit, 0.0, t[after] - t[before])
    outside = ~hit & ((time < t[0]) | (time > t[-1]))
    made = np.where(hit, x[after], np.interp(time, t, x))
    lost = outside | (width > reach * (1.0 + 1e-6))
    return np.where(lost, np.nan, made), ~lost & (width > GAP * period)


def _last(
    begin: FloatArray, time: FloatArray, known: FloatArray, values: FloatArray, reach: float, period: float
) -> tuple[FloatArray, Bools]:
    del begin
    good = np.isfinite(values)
    t, x = known[good], values[good]
    at = np.searchsorted(t, time + SAME, side="right") - 1
    age = np.where(at >= 0, time - np.append(t, np.inf)[at], np.inf)
    lost = age > reach * (1.0 + 1e-6)
    return np.where(lost, np.nan, np.append(x, np.nan)[at]), ~lost & (age > GAP * period)


def _difference(
    begin: FloatArray, time: FloatArray, known: FloatArray, values: FloatArray, reach: float, period: float
) -> tuple[FloatArray, Bools]:
    end, late = _linear(begin, time, known, values, reach, period)
    start, early = _linear(begin, begin, known, values, reach, period)
    return end - start, late | early


def _rate(
    begin: FloatArray, time: FloatArray, known: FloatArray, values: FloatArray, reach: float, period: float
) -> tuple[FloatArray, Bools]:
    gained, bridged = _difference(begin, time, known, values, reach, period)
    return gained / (time - begin), bridged


Take = Callable[[FloatArray, FloatArray, FloatArray, FloatArray, float, float], tuple[FloatArray, Bools]]
METHODS: dict[Method, Take] = {"linear": _linear, "last": _last, "difference": _difference, "rate": _rate}


def refused_hole(source: str, time: float, reach: float) -> DataError:
    """The error for a row at ``time`` s that no reading is near enough to."""
    return DataError(
        f"no reading of {source} at {time:.10g} s, nor any two around it within {reach:.6g} s",
        hint="`longest_gap` bridges more, `missing: empty` leaves the column empty there",
    )


def _apart(target: Stream, source: Stream) -> DataError:
    offset = float(source.time[0] - target.time[0])
    jump = jump_near(offset)
    sure = f"offset: {np.copysign(jump, offset):.10g} s" if jump else f"offset: {offset:.6g} s"
    return DataError(
        f"{source.name} goes from {source.time[0]:.10g} to {source.time[-1]:.10g} s, {target.name} from "
        f"{target.time[0]:.10g} to {target.time[-1]:.10g} s: no common time; are the clocks about {abs(offset):.6g} s apart"
        f"{known_jump(offset) or '?'}",
        hint=f"set the clock first: {{kind: shift, stream: {source.name}, {sure}}}"
        f"{'' if jump else ' if both began together; `lag_check` compares what they see'}",
    )


def _cut(target: Stream, source: Stream, inside: Bools) -> tuple[Event, ...]:
    lost = int(np.count_nonzero(~inside))
    if not lost:
        return ()
    used = target.time[inside]
    before, after = int(np.argmax(inside)), int(np.argmax(inside[::-1]))
    text = f"rows without a reading of {source.name} are cut: {before} before {used[0]:.10g} s, {after} after {used[-1]:.10g} s"
    return (Event(float(target.time[int(np.argmax(~inside))]), target.name, "cut", text, lost),)


def _readings(result: Stream, source: Stream, made: FloatArray, bridged: Bools) -> tuple[Event, ...]:
    events = []
    for kind, which, text in (
        ("missing", np.isnan(made), f"no reading of {source.name} near enough: the column is empty there"),
        ("bridged", bridged, f"rows over gaps of {source.name} get what lies between the readings around them"),
    ):
        first, count = count_of(which)
        if count:
            events.append(Event(float(result.time[first]), result.name, kind, text, count))
    return tuple(events)
