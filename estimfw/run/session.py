"""A streaming session: push samples, read the estimate.

The same scan as in a batch run, a chunk of one step at a time, so the estimates are equal. A measurement row that comes after
its instant has passed is *late*: it is counted and not fused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import Event, Record, Stream
from estimfw.data.timeline import Due, Steps
from estimfw.errors import DataError, UsageError
from estimfw.estimators.scan import ChunkResult
from estimfw.kernels.fuse import MEANINGS
from estimfw.model.nominal import InitialNominal
from estimfw.run.outputs import output_values
from estimfw.run.prepare import Prepared, filter_start, make_chunk

__all__ = ["Estimate", "Session"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Estimate:
    """The filter after a step.

    ``states`` and ``outputs`` map a label to (value, sigma) in SI; ``covariance`` is (n, n); ``dispositions`` says what became of
    each measurement that was due.
    """

    time: float
    states: Mapping[str, tuple[float, float]]
    outputs: Mapping[str, tuple[float, float]]
    covariance: FloatArray
    dispositions: Mapping[str, str]


class Session:
    """A filter that is fed by hand.

    Parameters
    ----------
    problem : Problem
        Composed config; its source is not used.
    start : InitialNominal, optional
        Where the nominal starts; needed where the config has a moving nominal and no given start.
    time : float, s
        The instant of the start.
    """

    def __init__(self, problem: Problem, start: InitialNominal | None = None, time: float = 0.0) -> None:
        given = start if start is not None else self._given(problem)
        self.problem = problem
        self.start = problem.provider.start(given, Record({}))
        self.bound = problem.provider.bind(problem.settings)
        self.time = time
        self.events: list[Event] = []
        self._waiting: list[FloatArray] = []
        self._stamps: list[float] = []
        self._readings: dict[str, list[tuple[float, FloatArray]]] = {}
        self._ticks = dict.fromkeys((m.name for m in problem.plan.measurements), 0)
        self._begin = time
        row = (
            self.bound.initial_row(self.start)
            if self.bound is not None
            else problem.plan.layout.pack(problem.reference)
        )
        self._scan, self._state, self._prior = filter_start(
            problem, self.bound, self.start, row, self._steps(time, 0.0)
        )
        self._last: Estimate | None = None

    @staticmethod
    def _given(problem: Problem) -> InitialNominal | None:
        return problem.initial.reference() if problem.initial is not None else None

    @property
    def estimate(self) -> Estimate | None:
        """After the last step; None before the first."""
        return self._last

    def measure(self, stream: str, time: float, values: ArrayLike) -> None:
        """Hand over a measurement row; it is fused at the end of the step in which it lies.

        Parameters
        ----------
        stream : str
        time : float, s
        values : (columns,) array
            In the order of the measurement's columns, SI; NaN marks a missing component.

        Raises
        ------
        UsageError
            No measurement reads that stream.
        """
        readers = [m for m in self.problem.plan.measurements if m.stream == stream]
        if not readers:
            known = sorted(str(m.stream) for m in self.problem.plan.measurements if m.stream)
            raise UsageError(
                f"no measurement reads the stream {stream!r}", hint=f"streams: {', '.join(known) or 'none'}"
            )
        row = np.atleast_1d(np.asarray(values, dtype=float))
        if row.shape != (readers[0].rows,):
            raise DataError(f"stream {stream!r}: {row.size} values, {readers[0].rows} are due")
        if time <= self.time + 1e-9:
            text = f"came when the filter was at {self.time:g} s already: not fused"
            self.events.append(Event(time, stream, "late", text))
            return
        self._readings.setdefault(stream, []).append((time, row))

    def push(self, time: float, sample: ArrayLike) -> Estimate | None:
        """Hand over a row of the driving stream (an IMU's increments); a step is done when enough of them are there.

        Raises
        ------
        DataError
            Time does not advance, or the row is not finite.
        """
        if self.bound is None:
            raise UsageError("this model has no driving stream", hint="use advance(time)")
        row = np.asarray(sample, dtype=float)
        if not np.all(np.isfinite(row)):
            raise DataError(f"the sample at {time:g} s is not finite")
        newest = self._stamps[-1] if self._stamps else self.time
        if time <= newest + 1e-9:
            raise DataError(f"time does not advance: {time:g} s after {newest:g} s")
        self._waiting.append(row)
        self._stamps.append(time)
        if len(self._waiting) < self.problem.provider.samples_per_step:
            return None
        return self._advance(time)

    def advance(self, time: float) -> Estimate:
        """Go to an instant, for a model without a driving stream, and fuse what lies up to it.

        Raises
        ------
        UsageError
            The model has a driving stream.
        """
        if self.bound is not None:
            raise UsageError("this model is driven by a stream", hint="use push(time, sample)")
        return self._advance(time)

    def _advance(self, time: float) -> Estimate:
        period = (time - self.time) / max(1, len(self._stamps))
        rows = np.array(self._waiting) if self._waiting else np.zeros((0, 0))
        driver = str(self.problem.provider.stream)
        streams = {driver: Stream(driver, np.array(self._stamps), rows, (), "increment", period)} if len(rows) else {}
        steps = self._steps(time, time - self.time)
        due = {}
        for m in self.problem.plan.measurements:
            if m.stream is None:
                due[m.name] = self._pseudo(m.name, m.every, time)
                continue
            found, due[m.name] = self._reading(m.stream, time, m.columns)
            streams[m.stream] = found
        prepared = Prepared(
            self.problem, self.problem.plan, Record(streams), self.start, self.bound,
            replace(steps, due=due, rows=np.array([0, len(rows)], dtype=np.int64)), self._scan, self._state, self._prior, (),
        )  # fmt: skip
        self._state, result = self._scan.run(self._state, make_chunk(prepared, 0, 1))
        self.time = time
        self._waiting.clear()
        self._stamps.clear()
        self._last = self._estimate(result)
        return self._last

    def _steps(self, time: float, dt: float) -> Steps:
        restart = any(
            self.time - 1e-9 < t <= time - 1e-9 and t <= self.time + 1e-9 for t in self.problem.estimator.restarts
        )
        return Steps(self.time, np.array([time]), np.array([dt]), np.zeros(2, np.int64), {}, np.array([restart]), ())

    def _pseudo(self, name: str, every: float | None, time: float) -> Due:
        if every is None:
            return Due(np.zeros(1, np.int64), np.array([time - self.time]))
        ticks = int(np.floor((time - self._begin) / every + 1e-6))
        fresh = ticks > self._ticks[name]
        self._ticks[name] = ticks
        return Due(np.array([0 if fresh else -1]), np.array([every]))

    def _reading(self, stream: str, time: float, columns: Sequence[str]) -> tuple[Stream, Due]:
        waiting = self._readings.get(stream, [])
        ready = [r for r in waiting if r[0] <= time + 1e-9]
        self._readings[stream] = [r for r in waiting if r[0] > time + 1e-9]
        if not ready:
            empty = Stream(stream, np.zeros(1), np.full((1, len(columns)), np.nan), tuple(columns))
            return empty, Due(np.array([-1]), np.ones(1))
        at, row = ready[-1]
        return Stream(stream, np.array([at]), row[None], tuple(columns)), Due(
            np.zeros(1, np.int64), np.array([time - self.time or 1.0])
        )

    def _estimate(self, result: ChunkResult) -> Estimate:
        plan = self.problem.plan
        rows = plan.layout.complete(result.rows)
        sigma = np.sqrt(np.maximum(np.diag(result.covariance[0]), 0.0))
        outputs: dict[str, tuple[float, float]] = {}
        for output, jacobian in plan.outputs:
            value, spread = output_values(self.problem, output, jacobian, result, rows)
            outputs |= {label: (float(value[0, i]), float(spread[0, i])) for i, label in enumerate(output.labels)}
        codes = {m.name: int(result.disposition[0, j]) for j, m in enumerate(plan.measurements)}
        return Estimate(
            time=self.time,
            states={s: (float(result.estimate[0, i]), float(sigma[i])) for i, s in enumerate(plan.states)},
            outputs=outputs,
            covariance=result.covariance[0],
            dispositions={name: MEANINGS[code] for name, code in codes.items() if code >= 0},
        )
