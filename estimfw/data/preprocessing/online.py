"""Preprocessing row by row, as the rows come: the same results as on the whole record, known ``latency`` s later.

A component goes with a session if it has ``online(layouts)``, which says in `Online` what it makes of each row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np

from estimfw.data.preprocessing.shift import Clock
from estimfw.data.record import Event, FloatArray
from estimfw.errors import UsageError
from estimfw.spelling import did_you_mean

__all__ = ["Layout", "Layouts", "Online", "OnlineShift", "Row", "layout_of", "refuse_back"]


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a stream: its stamp in s, and its values (k,)."""

    stream: str
    time: float
    values: FloatArray


@dataclass(frozen=True, slots=True)
class Layout:
    """What the rows of a stream are; see `estimfw.data.record.Stream`.

    ``period`` is the sampling interval in s, ``latency`` how many s after its stamp a row is known at the latest.
    """

    columns: tuple[str, ...]
    kind: Literal["increment", "mean", "sample"]
    period: float
    latency: float = 0.0


Layouts = Mapping[str, Layout]


class Online(Protocol):
    """A component at work in a session."""

    layouts: Layouts
    events: list[Event]

    def push(self, row: Row) -> Sequence[Row]:
        """Rows that are known now that ``row`` came; those of other streams go through as they are."""
        ...

    def finish(self) -> Sequence[Row]:
        """Rows that waited for one that will not come."""
        ...


def layout_of(layouts: Layouts, stream: str) -> Layout:
    """The layout of a stream; UsageError with the nearest name if nobody gave it."""
    if stream not in layouts:
        raise UsageError(f"the session is not told what the rows of {stream!r} are", hint=did_you_mean(stream, layouts))
    return layouts[stream]


def refuse_back(row: Row, before: float) -> None:
    """UsageError where a row is not later than the one before of its stream."""
    if not row.time > before:
        raise UsageError(
            f"stream {row.stream!r}: a row at {row.time:.10g} s after one at {before:.10g} s",
            hint="preprocessing in a session needs the rows of a stream in order",
        )


class OnlineShift:
    """See `estimfw.data.preprocessing.shift`."""

    def __init__(self, layouts: Layouts, stream: str, clock: Clock) -> None:
        own = layout_of(layouts, stream)
        # A row that is stamped late is known so much later than the instant that it gets.
        known = own.latency + max(clock.latency + clock.offset, 0.0)
        self.layouts: Layouts = {
            **layouts, stream: replace(own, period=own.period / (1.0 + clock.drift), latency=known),
        }  # fmt: skip
        self.events: list[Event] = []
        self._stream, self._clock = stream, clock

    def push(self, row: Row) -> Sequence[Row]:
        if row.stream != self._stream:
            return [row]
        return [replace(row, time=float(self._clock.instants(np.array(row.time))))]

    def finish(self) -> Sequence[Row]:
        return []
