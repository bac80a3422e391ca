"""A pulse counter in a session: a count is judged once the next one is there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from estimfw.data.preprocessing.counter import KINDS, TOLD, Counter, fits, moved
from estimfw.data.preprocessing.online import Layout, Layouts, Row, layout_of, refuse_back
from estimfw.data.preprocessing.rows import GAP
from estimfw.data.record import Event

__all__ = ["OnlineCounter"]

Reading = tuple[float, float]


@dataclass(slots=True)
class _Line:
    """One counter: its last good reading, the last one of all, one that waits for the next, and the total."""

    good: Reading | None = None
    before: Reading | None = None
    waiting: Reading | None = None
    total: float = 0.0


@dataclass(slots=True)
class _Pending:
    """A row that is not complete: of each column its result, None as long as it is not known."""

    time: float
    values: list[float | None] = field(default_factory=list)


class OnlineCounter:
    """See `estimfw.data.preprocessing.counter.counted`."""

    def __init__(
        self, layouts: Layouts, stream: str, columns: Mapping[str, str], counter: Counter,
        output: Literal["rate", "increment", "count"], into: str,
    ) -> None:  # fmt: skip
        own = layout_of(layouts, stream)
        made = Layout(tuple(columns.values()), KINDS[output], own.period, own.latency + own.period)
        self.layouts: Layouts = {**layouts, into: made}
        self.events: list[Event] = []
        self._stream, self._into, self._names = stream, into, list(columns)
        self._at = [own.columns.index(c) for c in columns]
        self._counter, self._output, self._period = counter, output, own.period
        self._lines = [_Line() for _ in columns]
        self._pending: list[_Pending] = []
        self._newest, self._first = -np.inf, True

    def push(self, row: Row) -> Sequence[Row]:
        if row.stream != self._stream:
            return [row]
        refuse_back(row, self._newest)
        self._newest = row.time
        self._pending.append(_Pending(row.time, [None] * len(self._at)))
        for i, at in enumerate(self._at):
            count = float(row.values[at])
            if np.isfinite(count):
                self._judge(i, (row.time, count))
                self._lines[i].waiting = (row.time, count)
            else:
                self._pending[-1].values[i] = np.nan
                self._tell("missing", i, row.time)
        made = [row] if self._into != self._stream else []
        return [*made, *self._complete()]

    def finish(self) -> Sequence[Row]:
        for i in range(len(self._lines)):
            self._judge(i, None)
        return self._complete()

    def _judge(self, i: int, following: Reading | None) -> None:
        """Decide on the reading that waits, by the one that follows it."""
        line, c = self._lines[i], self._counter
        reading = line.waiting
        if reading is None:
            return
        before = line.before
        spike = (
            before is not None
            and following is not None
            and not fits(before, reading, c)
            and not fits(reading, following, c)
            and fits(before, following, c)
        )
        line.before, line.waiting = reading, None
        self._settle(i, reading, self._spike(i, reading) if spike else self._value(i, reading))

    def _spike(self, i: int, reading: Reading) -> float:
        self._tell("spike", i, reading[0])
        return np.nan

    def _value(self, i: int, reading: Reading) -> float:
        """What the output is at a good reading."""
        line, scale = self._lines[i], self._counter.scale
        good, line.good = line.good, reading
        if good is None:
            line.total = reading[1]
            return line.total * scale if self._output == "count" else np.nan
        step, known, kind = moved(good, reading, self._counter)
        line.total += known
        if kind:
            self._tell(kind, i, reading[0])
        if self._output == "count":
            return line.total * scale
        elapsed = reading[0] - good[0]
        if self._output == "increment":
            return step * scale
        return np.nan if elapsed > GAP * self._period else step / elapsed * scale

    def _settle(self, i: int, reading: Reading, value: float) -> None:
        for pending in self._pending:
            if pending.time == reading[0]:
                pending.values[i] = value

    def _tell(self, kind: str, i: int, time: float) -> None:
        self.events.append(Event(time, self._stream, kind, f"{self._names[i]}: {TOLD[kind]}"))

    def _complete(self) -> list[Row]:
        rows = []
        while self._pending and None not in self._pending[0].values:
            ready = self._pending.pop(0)
            if not (self._first and self._output != "count"):
                rows.append(Row(self._into, ready.time, np.array(ready.values, dtype=float)))
            self._first = False
        return rows
