"""What plugins hand over while a filter runs is checked where it enters: records, findings, nominal rows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Findings, Record, Stream
from estimfw.model.nominal import BoundProvider, InitialNominal
from estimfw.registry.contract import broken, plugin_code, wrong_number

__all__ = ["GuardedProvider", "check_findings", "check_record"]

FloatArray = NDArray[np.float64]


def check_record(record: Any, owner: str | None, what: str, *, leading: bool = False) -> Record:
    """The record, if it is one: streams whose times, values and columns fit each other. Values may be NaN, times not.

    ``leading``: values may have leading axes, of runs.

    Raises
    ------
    PluginError
    """
    if not isinstance(record, Record):
        raise broken(owner, what, f"made an object of type {type(record).__name__}, a Record is due")
    for name, stream in record.streams.items():
        rows, columns = np.shape(stream.time)[:1], len(stream.columns)
        fault = wrong_number(stream.time, rows)
        fault = f"its time {fault}" if fault is not None else None
        shape = np.shape(stream.values)[-2:] if leading else np.shape(stream.values)
        if fault is None and shape != (*rows, columns):
            fault = f"values {shape} for {rows[0]} times and {columns} columns"
        if fault is None and stream.arrival is not None:
            fault = wrong_number(stream.arrival, rows)
            fault = f"its arrival {fault}" if fault is not None else None
        if fault is not None:
            raise broken(owner, what, f"made a stream {name!r} that is none: {fault}")
    return record


def check_findings(findings: Any, owner: str | None, what: str) -> Findings:
    """What a monitor found, if it is that."""
    if not isinstance(findings, Findings):
        raise broken(owner, what, f"returned an object of type {type(findings).__name__}, Findings are due")
    return findings


class GuardedProvider:
    """A bound provider of a plugin whose rows are looked at, step by step; the compiled form is not.

    Parameters
    ----------
    inner : BoundProvider
    owner, kind : str
        For the message.
    size : int
        Numbers in a row.
    """

    def __init__(self, inner: BoundProvider, owner: str, kind: str, size: int) -> None:
        self.inner, self.owner, self.kind, self.size = inner, owner, kind, size
        self.params, self.n_state, self.n_sample = inner.params, inner.n_state, inner.n_sample
        self.compiled = inner.compiled
        self.times, self.done = np.zeros(0), 0

    def initial_state(self, initial: InitialNominal) -> FloatArray:
        with plugin_code(self.owner, f"initial_state() of nominal {self.kind!r}"):
            return self.inner.initial_state(initial)

    def initial_row(self, initial: InitialNominal) -> FloatArray:
        with plugin_code(self.owner, f"initial_row() of nominal {self.kind!r}"):
            row = self.inner.initial_row(initial)
        return self._checked(row, "the row at the start")

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        """Remembers the ends of the steps, so that a fault in one can be told with its time."""
        self.times, self.done = stream.time[rows[1:] - 1], 0
        with plugin_code(self.owner, f"samples() of nominal {self.kind!r}"):
            return self.inner.samples(stream, rows)

    def samples_between(self, begin: FloatArray, end: FloatArray) -> FloatArray:
        """Of a provider that time alone drives; remembers the ends of the steps."""
        self.times, self.done = end, 0
        with plugin_code(self.owner, f"samples_between() of nominal {self.kind!r}"):
            samples = self.inner.samples_between(begin, end)  # type: ignore[attr-defined]
        shape = (*np.shape(end), self.n_sample)
        if np.shape(samples) != shape:
            what = f"samples_between() of nominal {self.kind!r}"
            raise broken(self.owner, what, f"made samples {np.shape(samples)}, {shape} is due")
        return np.asarray(samples, dtype=float)

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        self.done += 1
        with plugin_code(self.owner, f"step() of nominal {self.kind!r}{self._when()}"):
            state, process_row, end_row = self.inner.step(state, sample)
        if np.all(np.isfinite(sample)):
            self._checked(process_row, "the process row")
            self._checked(end_row, "the end row")
        return state, process_row, end_row

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        with plugin_code(self.owner, f"correct() of nominal {self.kind!r}{self._when()}"):
            return self.inner.correct(state, delta)

    def __getattr__(self, name: str) -> Any:
        """What a provider may have besides: ``difference``."""
        if name != "difference":
            raise AttributeError(name)
        inner = self.inner.difference  # type: ignore[attr-defined]

        def difference(state: FloatArray, other: FloatArray) -> FloatArray:
            with plugin_code(self.owner, f"difference() of nominal {self.kind!r}{self._when()}"):
                return np.asarray(inner(state, other))

        return difference

    def _when(self) -> str:
        return f" at t = {self.times[self.done - 1]:.10g} s" if 0 < self.done <= self.times.size else ""

    def _checked(self, row: FloatArray, name: str) -> FloatArray:
        fault = wrong_number(row, (*np.shape(row)[:-1], self.size))
        if fault is not None:
            raise broken(self.owner, f"nominal {self.kind!r}", f"made {name}{self._when()}, which {fault}")
        return row
