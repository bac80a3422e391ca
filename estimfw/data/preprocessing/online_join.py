"""Streams joined in a session: a row waits until the readings around it are there, or can no longer come."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimfw.data.preprocessing.joining import METHODS, Joining, refused_hole
from estimfw.data.preprocessing.online import Layouts, Row, layout_of, refuse_back
from estimfw.data.preprocessing.rows import GAP
from estimfw.data.record import SAME, Event, FloatArray
from estimfw.errors import UsageError

__all__ = ["OnlineJoin"]


class OnlineJoin:
    """See `estimfw.data.preprocessing.joining.joined`."""

    def __init__(self, layouts: Layouts, stream: str, onto: str, columns: Mapping[str, str], joining: Joining) -> None:
        source, target = layout_of(layouts, stream), layout_of(layouts, onto)
        if source.kind == "increment":
            raise UsageError(f"stream {stream!r} holds increments, which cannot be joined", hint="join a rate")
        self._reach = joining.longest_gap if joining.longest_gap is not None else GAP * source.period
        waits = source.latency + (0.0 if joining.method == "last" else source.period)
        latency = max(target.latency, waits)
        self.layouts: Layouts = {
            **layouts, onto: replace(target, columns=(*target.columns, *columns.values()), latency=latency),
        }  # fmt: skip
        self.events: list[Event] = []
        self._stream, self._onto, self._take = stream, onto, METHODS[joining.method]
        self._last_holds, self._spans = joining.method == "last", joining.method in ("difference", "rate")
        self._refuses = joining.missing == "refuse"
        self._at = [source.columns.index(c) for c in columns]
        self._middle = 0.5 * source.period if source.kind == "mean" and joining.method == "linear" else 0.0
        self._period, self._step = source.period, target.period
        self._lead = source.latency - target.latency
        self._known: list[float] = []
        self._values: list[FloatArray] = []
        self._begun: float | None = None  # the first reading of all
        self._waiting: list[tuple[float, Row]] = []  # with the begin of its interval
        self._newest = {stream: -np.inf, onto: -np.inf}

    def push(self, row: Row) -> Sequence[Row]:
        if row.stream == self._stream:
            refuse_back(row, self._newest[self._stream])
            self._known.append(row.time - self._middle)
            self._values.append(row.values[self._at])
            self._begun = self._known[0] if self._begun is None else self._begun
        elif row.stream == self._onto:
            before = self._newest[self._onto]
            refuse_back(row, before)
            begin = row.time - self._step if row.time - before > GAP * self._step else before
            self._waiting.append((begin, row))
        else:
            return [row]
        self._newest[row.stream] = row.time
        return [*([row] if row.stream == self._stream else []), *self._settled(last=False)]

    def finish(self) -> Sequence[Row]:
        return self._settled(last=True)

    def _settled(self, *, last: bool) -> list[Row]:
        """Rows that no reading can change any more, joined; ``last``: none will come."""
        rows: list[Row] = []
        while self._waiting and self._begun is not None:
            begin, row = self._waiting[0]
            end = self._known[-1] + (self._reach if self._last_holds else 0.0)
            if (begin if self._spans else row.time) < self._begun - SAME:
                self._cut(row)
            elif (row.time <= end + SAME) if last else self._is_settled(row.time):
                rows.append(self._joined(begin, row))
            elif last:
                self._cut(row)
            else:
                break
            self._waiting.pop(0)
            self._forget(begin)
        return rows

    def _is_settled(self, time: float) -> bool:
        """Whether readings up to a time are there, and the next ones of all columns, or too far away."""
        if self._last_holds:
            return self._horizon() >= time - SAME
        known, values = np.array(self._known), np.isfinite(np.array(self._values))
        for column in values.T:
            before, after = known[column & (known < time - SAME)], known[column & (known >= time - SAME)]
            reach = self._reach * (1.0 + 1e-6)
            lost = self._horizon() >= time - SAME and (not before.size or self._horizon() - before[-1] > reach)
            if not after.size and not lost:
                return False
        return True

    def _horizon(self) -> float:
        """Up to here all readings are there: by their own stamps, or because the other stream is so much farther on."""
        silent = self._newest[self._onto] - self._lead - self._middle - self._period
        return max(self._known[-1], silent)

    def _joined(self, begin: float, row: Row) -> Row:
        known, values = np.array(self._known), np.array(self._values)
        made = []
        for column in values.T:
            x, bridged = self._take(np.array([begin]), np.array([row.time]), known, column, self._reach, self._period)
            made.append(float(x[0]))
            if self._refuses and np.isnan(x[0]):
                raise refused_hole(self._stream, row.time, self._reach)
            for kind, which in (("missing", np.isnan(x[0])), ("bridged", bridged[0])):
                if which:
                    text = (
                        f"no reading of {self._stream} near enough"
                        if kind == "missing"
                        else f"over a gap of {self._stream}"
                    )
                    self.events.append(Event(row.time, self._onto, kind, text))
        return replace(row, values=np.concatenate([row.values, made]))

    def _cut(self, row: Row) -> None:
        self.events.append(Event(row.time, self._onto, "cut", f"without a reading of {self._stream}: cut"))

    def _forget(self, begin: float) -> None:
        """Readings before the last ones that the next row can need."""
        needed = len(self._known)
        for column in np.isfinite(np.array(self._values)).T:
            there = [k for k in np.flatnonzero(column).tolist() if self._known[k] <= begin + SAME]
            needed = min(needed, there[-1] if there else 0)
        needed = min(needed, max(len(self._known) - 1, 0))
        del self._known[:needed], self._values[:needed]
