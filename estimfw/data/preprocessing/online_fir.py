"""The low-pass filter in a session: a window is filtered once it is whole and its holes are known to be bridged or not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimfw.data.preprocessing.fir import LowPass, steps_between, taps_for
from estimfw.data.preprocessing.online import Layout, Layouts, Row, layout_of, refuse_back
from estimfw.data.record import Event, FloatArray

__all__ = ["OnlineFir"]


class OnlineFir:
    """See `estimfw.data.preprocessing.fir.low_passed`."""

    def __init__(self, layouts: Layouts, stream: str, columns: tuple[str, ...], low_pass: LowPass, into: str) -> None:
        own = layout_of(layouts, stream)
        means = own.kind != "sample"
        self._taps = taps_for(low_pass, own.period, means=means)
        self._longest = round(low_pass.longest_gap / own.period + 1e-6)
        names = columns or own.columns
        latency = own.latency + (0.5 * self._taps.size + self._longest) * own.period
        self.layouts: Layouts = {**layouts, into: Layout(names, "sample", own.period, latency)}
        self.events: list[Event] = []
        self._stream, self._into, self._period = stream, into, own.period
        self._at = [own.columns.index(c) for c in names]
        self._middle = 0.5 * (self._taps.size - 1) - (0.5 if means else 0.0)
        room = 2 * (self._taps.size + self._longest) + 64
        self._grid = np.empty((room, len(names)))
        self._times = np.empty(room)  # of the grid, NaN where there is no row
        self._first = self._end = 0
        self._gone, self._behind = (
            np.nan,
            0,
        )  # time of the last row before the buffer, and how many places it lies before
        self._newest = -np.inf
        self._hole = np.zeros(len(names), dtype=np.int64)  # rows since the last reading
        self._seen = np.zeros(len(names), dtype=bool)

    def push(self, row: Row) -> Sequence[Row]:
        if row.stream != self._stream:
            return [row]
        refuse_back(row, self._newest)
        if self._end:
            lost = steps_between(self._stream, np.array([self._newest, row.time]), self._period)[0] - 1
            for _ in range(int(lost)):
                self._append(np.nan, np.full(len(self._at), np.nan))
        values, self._newest = row.values[self._at], row.time
        self._append(row.time, np.where(np.isfinite(values), values, np.nan))
        made = [row] if self._into != self._stream else []
        return [*made, *self._whole()]

    def finish(self) -> Sequence[Row]:
        self._hole[:] = self._longest + 1
        return self._whole()

    def _append(self, time: float, values: FloatArray) -> None:
        if self._end == self._times.size:
            self._make_room()
        self._times[self._end], self._grid[self._end] = time, values
        self._end += 1
        for i, x in enumerate(values):
            if np.isnan(x):
                self._hole[i] += 1
                continue
            if self._seen[i] and 0 < self._hole[i] <= self._longest:
                self._bridge(i, int(self._hole[i]))
            self._hole[i], self._seen[i] = 0, True

    def _make_room(self) -> None:
        """Move what is still needed to the front, of a larger buffer where that is most of it."""
        kept = slice(self._first, self._end)
        size = self._end - self._first
        room = self._times.size * (2 if 2 * size > self._times.size else 1)
        grid, times = np.empty((room, self._grid.shape[1])), np.empty(room)
        grid[:size], times[:size] = self._grid[kept], self._times[kept]
        self._grid, self._times, self._first, self._end = grid, times, 0, size

    def _bridge(self, i: int, hole: int) -> None:
        last = self._end - 1
        first = last - hole - 1
        a, b = self._grid[first, i], self._grid[last, i]
        self._grid[first:last, i] = a + (b - a) * np.arange(hole + 1) / (hole + 1)
        at = self._time(float(first + 1 - self._first))
        text = "missing readings put in on a straight line, before the low-pass filter"
        self.events.append(Event(at, self._stream, "bridged", text, hole))

    def _whole(self) -> list[Row]:
        """The output of each window of which nothing can change any more."""
        open_ = np.where(self._seen & (self._hole <= self._longest), self._hole, 0)
        settled, rows = self._end - int(open_.max(initial=0)), []
        while settled >= self._first + self._taps.size:
            window = self._grid[self._first : self._first + self._taps.size]
            out = np.array([np.convolve(line, self._taps, "valid")[0] for line in window.T])
            time = self._time(self._middle)
            if np.isnan(out).any():
                text = "readings are missing within the window of the low-pass filter: its output is missing"
                self.events.append(Event(time, self._stream, "missing", text, int(np.isnan(out).sum())))
            rows.append(Row(self._into, time, out))
            self._go_on()
        return rows

    def _go_on(self) -> None:
        """The first row of the buffer is not needed any more, but for its time: rows after it may be lost."""
        if np.isfinite(self._times[self._first]):
            self._gone, self._behind = float(self._times[self._first]), 0
        self._first += 1
        self._behind += 1

    def _time(self, place: float) -> float:
        """The instant at a place among the rows of the buffer."""
        times = np.append(self._gone, self._times[self._first : self._end])
        places = np.append(-self._behind, np.arange(times.size - 1))
        there = np.isfinite(times)
        return float(np.interp(place, places[there], times[there]))
