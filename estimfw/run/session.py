"""A streaming session: push samples, read the estimate.

The same scan as in a batch run, a chunk of one step at a time, and steps at the same instants, so the estimates are equal. A
measurement row that comes after its instant has passed is *late*: it is counted and not fused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import SAME, Event, Record, Stream
from estimfw.data.timeline import Steps
from estimfw.errors import DataError, UsageError
from estimfw.estimators.bank import judge, reported, weights
from estimfw.estimators.scan import Chunk, ChunkResult, FilterState, refuse_lost, row_offsets
from estimfw.estimators.stretch import Stretch
from estimfw.kernels.fuse import LATE, MEANINGS
from estimfw.model.nominal import InitialNominal, changing_at
from estimfw.run.given_start import given_start
from estimfw.run.held_inputs import HeldInputs
from estimfw.run.outputs import output_values
from estimfw.run.prepare import begin, timed_samples
from estimfw.run.session_smoother import SessionSmoother, SmoothedEstimate
from estimfw.run.waiting_rows import DueRow, WaitingRows

__all__ = ["Estimate", "Session", "SmoothedEstimate"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Estimate:
    """The filter after a step.

    ``states`` and ``outputs`` map a label to (value, sigma) in SI; ``covariance`` is (n, n). ``dispositions`` says what became of
    each measurement that was due, or late since the step before; ``nis`` holds the NIS of those that were due.
    Of a bank it is the likeliest ``member``; ``weights`` are those of all, see `estimfw.estimators.bank`.
    ``smoothed`` are, with ``smoother: {kind: fixed_lag}``, the states that the lag has passed since the step before, the earliest
    first: mostly one, none while the session is shorter than the lag.
    """

    time: float
    states: Mapping[str, tuple[float, float]]
    outputs: Mapping[str, tuple[float, float]]
    covariance: FloatArray
    dispositions: Mapping[str, str]
    nis: Mapping[str, float]
    member: str = ""
    weights: Mapping[str, float] = field(default_factory=dict)
    smoothed: tuple[SmoothedEstimate, ...] = ()


class Session:
    """A filter that is fed by hand.

    Parameters
    ----------
    problem : Problem
        Composed config; its source is not used.
    start : InitialNominal, optional
        Where the nominal starts; needed where the config has a moving nominal and no given start. Where an alignment has to
        find it: ``problem.initial.find(record)`` with a record of the first samples; the session goes on from its time.
    time : float, s
        The instant of the start.
    periods : mapping of str to float, s, optional
        Nominal interval of streams. It matters where stamps are rounded, and where a measurement's noise is a density; what is
        not given is told by the stamps.
    record : Record, optional
        First rows, for a nominal provider that has to see them to start (a vehicle that moves).

    Attributes
    ----------
    time : float, s
        Where the filter is.
    events : list of Event
        Late rows, duplicates, rows that a later one of the same step superseded.

    Raises
    ------
    UsageError
        The config's start is found from a record, and none is given; or the config preprocesses its record, or smooths over an
        interval that a session cannot know.
    """

    def __init__(
        self,
        problem: Problem,
        start: InitialNominal | None = None,
        time: float = 0.0,
        periods: Mapping[str, float] | None = None,
        record: Record | None = None,
    ) -> None:
        if problem.preprocess:
            raise UsageError(
                f"a session does not preprocess: {', '.join(problem.preprocess)}",
                hint="PreprocessingSession takes raw rows; or hand over preprocessed ones and leave the section `preprocess` out",
            )
        given = start if start is not None else given_start(problem)
        self.problem, self.time, self.events = problem, time, list[Event]()
        self._plan, self._provider, self._periods = problem.plan, problem.provider, dict(periods or {})
        initial = self._provider.start(given, record if record is not None else Record({}))
        self._bound = self._provider.bind(problem.settings)
        one = Steps(time, np.array([time]), np.zeros(1), np.zeros(2, np.int64), {}, np.zeros(1, dtype=bool), ())
        self._members = begin(problem, self._bound, initial, one)
        self._states = [member.state for member in self._members]
        self._score = np.zeros(len(self._members))
        smoother = problem.estimator.smoother
        self._smoother = SessionSmoother(problem, smoother) if smoother is not None else None
        self._begin, self._steps, self._last = time, 0, None
        self._samples: list[FloatArray] = []
        self._stamps: list[float] = []
        measured = [known for known in self._plan.inputs if known.stream is not None]
        self._rows = WaitingRows((*self._plan.measurements, *measured), time, self._periods)
        self._inputs = HeldInputs(self._plan.inputs, self._rows.columns)
        self._late: set[str] = set()
        self._counts: dict[str, Counter[str]] = {m.name: Counter() for m in self._plan.measurements}
        self._ticks = dict.fromkeys((m.name for m in self._plan.measurements), 0)
        self._restarts = sorted(t for t in problem.estimator.restarts if t > time + SAME)
        self._lengths: dict[float, float] = {}
        if self._provider.stream in self._periods:
            self._length(self._periods[self._provider.stream] * self._provider.samples_per_step)

    _last: Estimate | None

    @property
    def estimate(self) -> Estimate | None:
        """After the last step; None before the first."""
        return self._last

    @property
    def counts(self) -> dict[str, dict[str, int]]:
        """Dispositions so far, by measurement."""
        return {name: {word: count[word] for word in MEANINGS} for name, count in self._counts.items()}

    def measure(self, stream: str, time: float, values: ArrayLike | Mapping[str, float]) -> None:
        """Hand over a measurement row; it is fused at the end of the step in which it lies.

        Parameters
        ----------
        stream : str
        time : float, s
        values : (columns,) array, or mapping of column to value
            In the order of the columns that the measurements read, SI; NaN marks a missing component.

        Raises
        ------
        UsageError
            Neither a measurement nor an input reads that stream.
        DataError
            Other values than the columns, or a second row at the same time that differs.
        """
        row = self._rows.row(stream, values)
        if not np.isfinite(time):
            raise DataError(f"stream {stream!r}: the time of a row is {time:g}")
        if time < self._begin - SAME or (self._last is not None and time <= self.time + SAME):
            text = f"came when the filter was at {self.time:g} s already: not fused"
            self.events.append(Event(time, stream, "late", text))
            for m in self._plan.measurements:
                if m.stream == stream:
                    self._late.add(m.name)
                    self._counts[m.name][MEANINGS[LATE]] += 1
        elif not self._rows.add(stream, time, row):
            self.events.append(Event(time, stream, "duplicate", "identical rows are used once"))
        else:
            self._inputs.add(stream, time, row)

    def push(self, time: float, sample: ArrayLike) -> Estimate | None:
        """Hand over a row of the driving stream (an IMU's increments); a step is done when enough of them are there.

        Raises
        ------
        UsageError
            The model has no driving stream.
        DataError
            Time does not advance, or the row is not finite or not complete.
        """
        if self._bound is None or self._provider.stream is None:
            raise UsageError("this model has no driving stream", hint="use advance(time)")
        row, columns = np.asarray(sample, dtype=float), self._provider.columns
        if row.shape != (len(columns),) or not np.all(np.isfinite(row)):
            raise DataError(
                f"the sample at {time:g} s is not {len(columns)} finite numbers",
                hint=f"in the order {', '.join(columns)}",
            )
        self._refuse_back(time, self._stamps[-1] if self._stamps else self.time)
        self._samples.append(row)
        self._stamps.append(time)
        if len(self._samples) < self._provider.samples_per_step:
            return None
        dt = self._length(time - self.time)
        period = dt / len(self._samples)
        stream = Stream(
            self._provider.stream, np.array(self._stamps), np.array(self._samples), columns, "increment", period
        )
        samples = self._bound.samples(stream, np.array([0, len(self._samples)]))
        self._samples.clear()
        self._stamps.clear()
        return self._step(time, dt, samples)

    def advance(self, time: float) -> Estimate:
        """Go to an instant, for a model without a driving stream.

        There is a step for each instant on the way at which something happens: a row, a pseudo-measurement, a restart, or a
        known input or a nominal that changes.

        Raises
        ------
        UsageError
            The model has a driving stream.
        DataError
            Time does not advance.
        """
        if self._provider.stream is not None:
            raise UsageError("this model is driven by a stream", hint="use push(time, sample)")
        if self._last is not None:
            self._refuse_back(time, self.time)
        elif not time >= self.time - SAME:
            raise DataError(f"time does not advance: {time:g} s, the start is at {self.time:g} s")
        estimate = None
        for instant in self._instants(time):
            dt = self._length(instant - self.time) if instant - self.time > SAME else 0.0
            samples = timed_samples(self._bound, np.array([instant - dt]), np.array([instant]))
            estimate = self._step(instant, dt, samples)
        assert estimate is not None
        return estimate

    @staticmethod
    def _refuse_back(time: float, newest: float) -> None:
        if not time > newest + SAME:
            raise DataError(f"time does not advance: {time:g} s after {newest:g} s")

    def _instants(self, time: float) -> list[float]:
        """Ends of the steps up to a time, the time itself included."""
        rows = [max(t, self.time) for t in self._rows.instants(time)]
        ahead = [*self._restarts, *self._inputs.instants, *changing_at(self._provider)]
        for every in {m.every for m in self._plan.measurements if m.every is not None}:
            done = int(np.floor((self.time - self._begin) / every + 1e-6))
            last = int(np.floor((time - self._begin) / every + 1e-9))
            ahead += [self._begin + every * k for k in range(done + 1, last + 1)]
        between = [t for t in ahead if self.time + SAME < t <= time + SAME]
        found = np.unique([*rows, *between, time])
        return [float(t) for t in found[np.concatenate([[True], np.diff(found) > SAME])]]

    def _length(self, dt: float) -> float:
        """Steps that differ by rounding of the stamps are one length, as in `estimfw.data.timeline`."""
        nominal = next(iter(self._lengths.values()), dt)
        if abs(dt - nominal) <= 1e-6 * nominal:
            dt = nominal
        return self._lengths.setdefault(round(dt, 9), dt)

    def _step(self, time: float, dt: float, samples: FloatArray) -> Estimate:
        restart = bool(self._restarts) and self._restarts[0] <= self.time + SAME
        if restart:
            self._restarts = [t for t in self._restarts if t > self.time + SAME]
        readings, due, interval = self._due(time, dt, self._rows.take(time))
        inputs = self._inputs.take(time - dt)
        chunk = Chunk(samples, np.array([dt]), np.array([restart]), inputs, readings, due, interval, np.array([time]))
        before = self._states[0]
        done = [member.scan.run(state, chunk) for member, state in zip(self._members, self._states, strict=True)]
        self._states, results = [state for state, _ in done], [result for _, result in done]
        judged = judge(self._plan, results, self._score, scored=self.problem.kind == "bank")
        self._score, result = judged.score[-1], reported(results, judged.best)
        refuse_lost(self._plan, result, self._steps, np.array([time]))
        self.time, self._steps = time, self._steps + 1
        smoothed = self._smoother.step(self._stretch(chunk, result, before)) if self._smoother is not None else ()
        self._last = self._estimate(result, int(judged.best[0]), smoothed)
        return self._last

    def _stretch(self, chunk: Chunk, result: ChunkResult, before: FilterState) -> Stretch:
        first = self._members[0]
        return Stretch(
            plan=self._plan,
            provider=self._bound,
            chunk=chunk,
            result=result,
            before=before,
            covariance_before=self._last.covariance if self._last is not None else first.prior[1],
            prior_mean=first.prior[0],
            prior=first.prior[1],
            time=np.array([self.time]),
            doublings=first.scan.doublings,
            closed_loop=self.problem.estimator.loop == "closed",
        )

    def _due(
        self, time: float, dt: float, rows: Mapping[str, DueRow]
    ) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
        offsets, many = row_offsets(self._plan), len(self._plan.measurements)
        readings, due, interval = np.zeros((1, offsets[-1])), np.zeros((1, many), dtype=bool), np.ones((1, many))
        for j, m in enumerate(self._plan.measurements):
            if m.stream is None:
                due[0, j], interval[0, j] = self._pseudo(m.name, m.every, time, dt)
            elif m.stream in rows:
                row = rows[m.stream]
                columns = [self._rows.columns[m.stream].index(c) for c in m.columns]
                readings[0, offsets[j] : offsets[j + 1]] = row.values[columns]
                due[0, j], interval[0, j] = True, row.interval
        for stream, row in rows.items():
            if row.superseded and any(m.stream == stream for m in self._plan.measurements):
                text = "more than one row in a step: the last one is used"
                self.events.append(Event(row.time, stream, "crowded", text, row.superseded))
        return readings, due, interval

    def _pseudo(self, name: str, every: float | None, time: float, dt: float) -> tuple[bool, float]:
        if every is None:
            return True, dt or next(iter(self._lengths.values()), 1.0)
        ticks = int(np.floor((time - self._begin) / every + 1e-6))
        fresh, self._ticks[name] = ticks > self._ticks[name], ticks
        return fresh, every

    def _estimate(self, result: ChunkResult, best: int, smoothed: tuple[SmoothedEstimate, ...]) -> Estimate:
        plan = self._plan
        rows = plan.layout.complete(result.rows)
        sigma = np.sqrt(np.maximum(np.diag(result.covariance[0]), 0.0))
        outputs: dict[str, tuple[float, float]] = {}
        for output, jacobian in plan.outputs:
            value, spread = output_values(self.problem, output, jacobian, result, rows)
            outputs |= {label: (float(value[0, i]), float(spread[0, i])) for i, label in enumerate(output.labels)}
        codes = {m.name: int(result.disposition[0, j]) for j, m in enumerate(plan.measurements)}
        due = {name: MEANINGS[code] for name, code in codes.items() if code >= 0}
        for name, word in due.items():
            self._counts[name][word] += 1
        late, self._late = self._late, set()
        return Estimate(
            time=self.time,
            states={s: (float(result.estimate[0, i]), float(sigma[i])) for i, s in enumerate(plan.states)},
            outputs=outputs,
            covariance=result.covariance[0],
            dispositions=dict.fromkeys(late, MEANINGS[LATE]) | due,
            nis={m.name: float(result.nis[0, j]) for j, m in enumerate(plan.measurements) if m.name in due},
            member=self._members[best].label if self.problem.kind == "bank" else "",
            weights=self._weights(),
            smoothed=smoothed,
        )

    def _weights(self) -> dict[str, float]:
        if self.problem.kind != "bank":
            return {}
        each = weights(self._score).tolist()
        return {member.label: weight for member, weight in zip(self._members, each, strict=True)}
