"""A streaming session: push samples, read the estimate.

The same scan as in a batch run, a chunk of one step at a time, and steps at the same instants, so the estimates are equal. A
measurement row that comes after its instant has passed is *late*: with a replay window that reaches back to it, the filter goes
back to the step in which it lies and does it and those after it again, else the row is counted and not fused.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

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
from estimfw.plan.stages import stage_of_steps
from estimfw.run.exchanged import silences_begun
from estimfw.run.given_start import given_start
from estimfw.run.held_inputs import HeldInputs
from estimfw.run.indefinite_noise import indefinite_noise
from estimfw.run.prepare import begin, timed_samples
from estimfw.run.recovery import Recovery, acts
from estimfw.run.rewind import Arrived, Done, History, Snapshot
from estimfw.run.session_estimate import Estimate, estimate_of
from estimfw.run.session_health import Watched
from estimfw.run.session_smoother import SessionSmoother, SmoothedEstimate
from estimfw.run.smoothing import smoothing_kernel
from estimfw.run.staging import StagedFilter
from estimfw.run.waiting_rows import DueRow, WaitingRows

__all__ = ["Estimate", "Session", "SmoothedEstimate"]

FloatArray = NDArray[np.float64]


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
    replay : float, s, optional
        How far it goes back for a late row; the steps of so long are kept. Left out: what the config says, ``estimator.replay``.

    Attributes
    ----------
    time : float, s
        Where the filter is.
    events : list of Event
        Rows that were late, or replayed, duplicates, rows that a later one of the same step superseded; what became of the health
        of the filter, and what was done about it.

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
        replay: float | None = None,
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
        self._score, self._covariance = np.zeros(len(self._members)), self._members[0].prior[1]
        self._filters = [StagedFilter(problem, member.scan, member.prior[1]) for member in self._members]
        self._stage = -1
        smoother = problem.estimator.smoother
        kernel = smoothing_kernel(self._members[0].scan)
        self._smoother = SessionSmoother(problem, smoother, kernel) if smoother is not None else None
        self._begin, self._steps, self._last = time, 0, None
        self._samples: list[FloatArray] = []
        self._stamps: list[float] = []
        measured = [known for known in self._plan.inputs if known.stream is not None]
        self._rows = WaitingRows((*self._plan.measurements, *measured), time, self._periods)
        self._inputs = HeldInputs(self._plan.inputs, self._rows.columns)
        self._late: set[str] = set()
        self._late_counts: Counter[str] = Counter()
        self._counts: dict[str, Counter[str]] = {m.name: Counter() for m in self._plan.measurements}
        window = replay if replay is not None else problem.estimator.replay
        if window > 0.0 and self._smoother is not None:
            raise UsageError(
                "a session that smooths cannot go back: what it smoothed is told already",
                hint="Session(..., replay=0), or no estimator.smoother",
            )
        if window > 0.0 and problem.kind == "decentralised":
            raise UsageError("nodes that have sent their words cannot go back", hint="Session(..., replay=0)")
        self._history = History(window) if window > 0.0 else None
        self._watched = Watched.of(problem)
        self._recovery = Recovery(problem) if acts(problem) else None
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
        late = MEANINGS[LATE]
        return {
            name: {word: count[word] if word != late else self._late_counts[name] for word in MEANINGS}
            for name, count in self._counts.items()
        }

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
        row = Arrived(stream, time, self._rows.row(stream, values))
        if not np.isfinite(time):
            raise DataError(f"stream {stream!r}: the time of a row is {time:g}")
        if time < self._begin - SAME or (self._last is not None and time <= self.time + SAME):
            self._came_late(row)
        elif not self._rows.add(stream, time, row.values):
            self._tell_duplicate(row)
        else:
            self._inputs.add(stream, time, row.values)
            if self._history is not None:
                self._history.pending.append(row)

    def _tell_duplicate(self, row: Arrived) -> None:
        self.events.append(Event(row.time, row.stream, "duplicate", "identical rows are used once"))

    def _came_late(self, row: Arrived) -> None:
        """Go back for the row if the steps that are kept reach so far; else it is counted."""
        at = f"came when the filter was at {self.time:g} s already"
        if self._history is not None and self._history.reaches(row.time, self.time):
            if self._history.knows(row):
                self._tell_duplicate(row)
                return
            self._replay(row, self._history)
            self.events.append(Event(row.time, row.stream, "replayed", f"{at}: gone back, and fused at its instant"))
            return
        self.events.append(Event(row.time, row.stream, "late", f"{at}: not fused"))
        for m in self._plan.measurements:
            if m.stream == row.stream:
                self._late.add(m.name)
                self._late_counts[m.name] += 1

    def _replay(self, row: Arrived, history: History) -> None:
        """Undo the step in which the row lies and all after it, and do them again with it."""
        undone, waiting = history.undone(row.time), history.pending
        self._restore(undone[0].before)
        told = {id(event) for one in undone for event in one.events}
        self.events[:] = [event for event in self.events if id(event) not in told]
        again = [*undone[0].arrived, *(r for one in undone[1:] for r in one.arrived), *waiting, row]
        for known in again[len(undone[0].arrived) :]:
            self._rows.add(known.stream, known.time, known.values)
            self._inputs.add(known.stream, known.time, known.values)
        history.pending = again
        for one in undone:
            if self._provider.stream is not None:
                self._step(one.time, one.dt, one.samples, asked=True)
            elif one.asked:
                self._go_to(one.time)

    def _snapshot(self) -> Snapshot:
        return Snapshot(
            time=self.time,
            steps=self._steps,
            states=list(self._states),
            score=self._score,
            last=self._last,
            rows=self._rows.copy(),
            inputs=self._inputs.copy(),
            counts={name: count.copy() for name, count in self._counts.items()},
            ticks=dict(self._ticks),
            restarts=self._restarts,
            lengths=dict(self._lengths),
            watched=self._watched,
            acting=self._recovery.judges if self._recovery is not None else (),
            anew=self._recovery is not None and self._recovery.restart,
        )

    def _restore(self, then: Snapshot) -> None:
        self.time, self._steps, self._last = then.time, then.steps, then.last
        self._states, self._score = list(then.states), then.score
        self._rows, self._inputs = then.rows.copy(), then.inputs.copy()
        self._counts = {name: count.copy() for name, count in then.counts.items()}
        self._ticks, self._restarts, self._lengths = dict(then.ticks), then.restarts, dict(then.lengths)
        self._watched = then.watched
        if self._recovery is not None:
            self._recovery.judges, self._recovery.restart = then.acting, then.anew

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
        return self._step(time, dt, samples, asked=True)

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
        return self._go_to(time)

    def _go_to(self, time: float) -> Estimate:
        estimate = None
        for instant in self._instants(time):
            dt = self._length(instant - self.time) if instant - self.time > SAME else 0.0
            samples = timed_samples(self._bound, np.array([instant - dt]), np.array([instant]))
            estimate = self._step(instant, dt, samples, asked=abs(instant - time) <= SAME)
        assert estimate is not None
        return estimate

    @staticmethod
    def _refuse_back(time: float, newest: float) -> None:
        if not time > newest + SAME:
            raise DataError(f"time does not advance: {time:g} s after {newest:g} s")

    def _instants(self, time: float) -> list[float]:
        """Ends of the steps up to a time, the time itself included."""
        rows = [max(t, self.time) for t in self._rows.instants(time)]
        ends = [stage.until for stage in self._plan.stages if stage.until is not None]
        ahead = [*self._restarts, *self._inputs.instants, *changing_at(self._provider), *ends]
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
        if round(dt, 9) not in self._lengths:
            first = self._members[0]
            self.events += indefinite_noise(self._plan, first.state.row, np.array([dt]), first.scan.doublings)
        return self._lengths.setdefault(round(dt, 9), dt)

    def _step(self, time: float, dt: float, samples: FloatArray, *, asked: bool) -> Estimate:
        """One step to an instant; ``asked``: somebody wants to be there, whatever rows there are."""
        before, told = self._snapshot() if self._history is not None else None, len(self.events)
        restart = bool(self._restarts) and self._restarts[0] <= self.time + SAME
        if restart:
            self._restarts = [t for t in self._restarts if t > self.time + SAME]
        restart = restart or (self._recovery is not None and self._recovery.restart)
        self._enter_stage(time - dt)
        readings, due, interval = self._due(time, dt, self._rows.take(time))
        inputs = self._inputs.take(time - dt)
        chunk = Chunk(samples, np.array([dt]), np.array([restart]), inputs, readings, due, interval, np.array([time]))
        begun = self._states[0]
        done = [one.scan.run(state, chunk) for one, state in zip(self._filters, self._states, strict=True)]
        self._states, results = [state for state, _ in done], [result for _, result in done]
        judged = judge(self._plan, results, self._score, scored=self.problem.kind == "bank")
        self._score, result = judged.score[-1], reported(results, judged.best)
        refuse_lost(self._plan, result, self._steps, np.array([time]))
        self.events += silences_begun(self._filters[0].scan, time)
        self.time, self._steps = time, self._steps + 1
        smoothed = self._smoother.step(self._stretch(chunk, result, begun)) if self._smoother is not None else ()
        self._last = self._estimate(result, int(judged.best[0]), smoothed)
        self._look_after(result)
        if before is not None and self._history is not None:
            arrived, self._history.pending = self._history.pending, []
            self._history.add(Done(before, time, dt, samples, asked, arrived, self.events[told:]))
        return self._last

    def _look_after(self, result: ChunkResult) -> None:
        """Tell what became of the filter's health, and do what the config wants about it."""
        self._watched, events = self._watched.after(self.problem, self.time, result)
        self.events += events
        self._covariance = result.covariance[0]
        if self._recovery is None:
            return
        self._recovery.restart = False
        act = self._recovery.due(np.array([self.time]), result)
        if act is not None:
            self._states, (self._covariance, *_) = self._recovery.acted(
                self._members, self._states, [self._covariance], act, self.time
            )
            self.events.append(self._recovery.events[-1])

    def _stretch(self, chunk: Chunk, result: ChunkResult, before: FilterState) -> Stretch:
        first = self._members[0]
        return Stretch(
            plan=self._plan,
            provider=self._bound,
            chunk=chunk,
            result=result,
            before=before,
            covariance_before=self._covariance,
            prior_mean=first.prior[0],
            prior=first.prior[1],
            time=np.array([self.time]),
            doublings=first.scan.doublings,
            closed_loop=self.problem.estimator.loop == "closed",
        )

    def _enter_stage(self, begin: float) -> None:
        """That of a step that begins then; each on the way is gone through."""
        stages = self._plan.stages
        now = int(stage_of_steps(stages, np.array([begin]))[0]) if stages else -1
        while self._stage < now:
            self._stage += 1
            both = zip(self._filters, self._states, strict=True)
            self._states = [one.enter(self._stage, state)[0] for one, state in both]

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
        if self._plan.stages:
            due[0] &= self._plan.stages[self._stage].measured
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
        late, self._late = self._late, set()
        made = estimate_of(self.problem, result, self.time, late)
        for name, word in made.dispositions.items():
            if word != MEANINGS[LATE]:
                self._counts[name][word] += 1
        if self.problem.kind != "bank":
            return replace(made, smoothed=smoothed)
        labels = [member.label for member in self._members]
        each = dict(zip(labels, weights(self._score).tolist(), strict=True))
        return replace(made, member=labels[best], weights=each, smoothed=smoothed)
