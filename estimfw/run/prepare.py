"""From a composed problem and its record to a bound filter: the start, the timeline, the scan."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import SAME, Event, Findings, Record
from estimfw.data.timeline import Steps, Wanted, driven_steps, merged_steps
from estimfw.errors import DataError, PluginError
from estimfw.estimators.scan import Chunk, FilterState, SubSteps, row_offsets
from estimfw.model.nominal import BoundProvider, InitialNominal, ScheduledProvider, changing_at
from estimfw.plan.inputs import InputValues, inputs_at
from estimfw.plan.plan import Plan
from estimfw.policies.quotient import refuse_inexact
from estimfw.registry.contract import plugin_code
from estimfw.run.found_start import with_found_covariance
from estimfw.run.guard import GuardedProvider, check_findings
from estimfw.run.held_inputs import missing_readings, recorded_inputs
from estimfw.run.indefinite_noise import indefinite_noise
from estimfw.run.kernel_choice import Scan, chosen_scan, slow_kernel_events
from estimfw.run.member_starts import MemberStart, member_starts
from estimfw.run.staging import staged_steps

__all__ = ["Begun", "Prepared", "begin", "make_chunk", "prepare", "timed_samples"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Prepared:
    """A filter ready to run.

    ``start`` and ``state`` are where it begins; ``steps`` is the timeline; ``events`` is what was found before the run;
    ``inputs`` are the known inputs over the record. Of a bank it is the first member, and ``rivals`` are the others, which
    share everything but the start. ``label`` is the member's name for people.
    """

    problem: Problem
    plan: Plan
    record: Record
    start: InitialNominal
    bound: BoundProvider | None
    steps: Steps
    scan: Scan
    state: FilterState
    prior: tuple[FloatArray, FloatArray]
    events: tuple[Event, ...]
    inputs: tuple[InputValues, ...]
    label: str = ""
    rivals: tuple[Prepared, ...] = ()

    @property
    def members(self) -> tuple[Prepared, ...]:
        """All filters of a bank; the filter alone where it is none."""
        return (self, *self.rivals)


@dataclass(frozen=True)
class Begun:
    """A filter at its start: the recursion, its first state, the prior there."""

    start: InitialNominal
    label: str
    scan: Scan
    state: FilterState
    prior: tuple[FloatArray, FloatArray]


def prepare(problem: Problem, record: Record) -> Prepared:
    """Bind plan, provider and record.

    Raises
    ------
    DataError
        The record lacks a stream, rows or a start.
    """
    found = _findings(problem, record)
    with plugin_code(problem.owners.get("initial_attitude"), "find() of 'initial_attitude'"):
        given = problem.initial.find(record) if problem.initial is not None else None
    with plugin_code(problem.owners.get("nominal"), "start() of 'nominal'"):
        start = problem.provider.start(given, record)
    bound = _bound(problem)
    inputs = recorded_inputs(problem.plan.inputs, record)
    steps = staged_steps(problem, _until(_timeline(problem, record, start, found, inputs), found))
    missing = missing_readings(problem.plan.inputs, inputs, steps.start)
    first, *others = begin(problem, bound, start, steps)
    slow = slow_kernel_events(problem, bound, len(steps))
    noise = indefinite_noise(problem.plan, first.state.row, steps.dt, first.scan.doublings)
    events = (
        *record.events,
        *start.events,
        *(e for f in found for e in f.events),
        *steps.events,
        *missing,
        *slow,
        *noise,
    )
    common = partial(
        Prepared,
        problem=problem,
        plan=problem.plan,
        record=record,
        bound=bound,
        steps=steps,
        events=events,
        inputs=inputs,
    )
    return common(**_fields(first), rivals=tuple(common(**_fields(other)) for other in others))


def _fields(begun: Begun) -> dict[str, Any]:
    return {f.name: getattr(begun, f.name) for f in fields(begun)}


def _findings(problem: Problem, record: Record) -> list[Findings]:
    found = []
    for name, monitor in zip(problem.config.monitors, problem.monitors, strict=True):
        owner, what = problem.owners.get(f"monitors.{name}"), f"monitor {name!r}"
        with plugin_code(owner, f"inspect() of {what}"):
            knows = hasattr(monitor, "inspect_for")  # one that has to know the model sees it as it was before policies
            made = monitor.inspect_for(record, problem.full) if knows else monitor.inspect(record)
        found.append(check_findings(made, owner, what))
    return found


def _bound(problem: Problem) -> BoundProvider | None:
    owner = problem.owners.get("nominal")
    with plugin_code(owner, "bind() of 'nominal'"):
        bound = problem.provider.bind(problem.settings)
    if bound is None or owner is None:
        return bound
    return GuardedProvider(bound, owner, problem.provider.kind, problem.plan.layout.provided)


def _timeline(
    problem: Problem, record: Record, start: InitialNominal, found: list[Findings], inputs: tuple[InputValues, ...]
) -> Steps:
    plan = problem.plan
    wanted = [Wanted(m.name, m.stream, m.every) for m in plan.measurements]
    restarts = [*problem.estimator.restarts, *(t for f in found for t in f.restarts)]
    driver = problem.provider.stream
    if driver is None:
        instants = [*(float(t) for values in inputs for t in values.time), *changing_at(problem.provider)]
        instants += [stage.until for stage in plan.stages if stage.until is not None]
        return merged_steps(
            record.streams,
            wanted,
            instants=instants,
            start=start.time,
            restarts=restarts,
            replay=problem.estimator.replay,
        )
    if driver not in record.streams:
        raise DataError(
            f"the nominal provider needs the stream {driver!r}, which the source does not have",
            hint=f"it has: {', '.join(sorted(record.streams)) or 'none'}",
        )
    per_step = problem.provider.samples_per_step
    stream = record.streams[driver]
    replay = problem.estimator.replay
    return driven_steps(stream, per_step, record.streams, wanted, start=start.time, restarts=restarts, replay=replay)


def _until(steps: Steps, found: list[Findings]) -> Steps:
    """Cut where a monitor wants the run to stop."""
    stops = [f.stop for f in found if f.stop is not None]
    if not stops:
        return steps
    keep = steps.time <= min(stops) + SAME
    count = int(keep.sum())
    if count == 0:
        raise DataError(
            f"the run would stop before its first step, at {min(stops):g} s", hint="the vehicle moves from the start"
        )
    due = {n: d.take(keep) for n, d in steps.due.items()}
    return replace(
        steps,
        time=steps.time[keep],
        dt=steps.dt[keep],
        rows=steps.rows[: count + 1],
        due=due,
        restart=steps.restart[keep],
    )


def begin(problem: Problem, bound: BoundProvider | None, start: InitialNominal, steps: Steps) -> list[Begun]:
    """Each member of a bank at its start, for so many steps; a plain filter is the only one."""
    starts = member_starts(problem, start)
    made: list[Begun] = []
    for one in starts:
        first = made[0].scan if made else None
        made.append(_begun(problem, bound, one, steps, first, len(steps) * len(starts)))
    return made


def _begun(
    problem: Problem, bound: BoundProvider | None, one: MemberStart, steps: Steps, first: Scan | None, work: int
) -> Begun:
    """``first``: the scan of the first member, of which the others are like; ``work``: steps of all members."""
    plan, start = problem.plan, one.start
    row = (
        bound.initial_row(replace(start, time=steps.start))
        if bound is not None
        else plan.layout.pack({**problem.reference, **start.values})
    )
    nominal = plan.layout.unpack(plan.layout.complete(row))
    refuse_inexact(problem.model, nominal)
    mean, covariance = plan.prior.evaluate(nominal)
    prior = (mean, with_found_covariance(problem.model, covariance, start, nominal))
    form = _form(problem, prior[1])
    scan = (
        chosen_scan(problem, bound, row, prior, work) if first is None else first.begun(SubSteps(plan, row), mean, form)
    )
    for dt in np.unique(steps.dt):
        scan.doublings(float(dt))
    provider = bound.initial_state(start) if bound is not None else np.zeros(0)
    return Begun(start, one.label, scan, FilterState(mean.copy(), form, provider, row), prior)


def _form(problem: Problem, covariance: FloatArray) -> FloatArray:
    from estimfw.kernels import joseph, ud

    return ud.factor(covariance) if problem.estimator.covariance == "ud" else joseph.factor(covariance)


def make_chunk(prepared: Prepared, first: int, last: int) -> Chunk:
    """Inputs of steps ``first`` up to (not including) ``last``; samples and readings have the leading axes of the streams."""
    steps = prepared.steps
    own = slice(first, last)
    begin, driver = steps.time[own] - steps.dt[own], prepared.problem.provider.stream
    if driver is not None and prepared.bound is not None:
        samples = prepared.bound.samples(prepared.record.streams[driver], steps.rows[first : last + 1])
    else:
        samples = timed_samples(prepared.bound, begin, steps.time[own])
    readings, due, interval = _readings(prepared, own)
    known = inputs_at(prepared.inputs, begin)
    return Chunk(samples, steps.dt[own], steps.restart[own], known, readings, due, interval, steps.time[own])


def timed_samples(bound: BoundProvider | None, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Samples of a provider that no stream drives, for intervals from begin (K,) to end (K,), s; without one a column of zeros.

    Raises
    ------
    PluginError
        It says neither that a stream drives it nor what happens over time.
    """
    if bound is None:
        return np.zeros((len(end), 1))
    if not hasattr(bound, "samples_between"):
        raise PluginError(
            "the nominal provider names no stream that drives it, and has no `samples_between(begin, end)`",
            hint="one that time alone drives needs it; of one that nothing drives, bind() returns None",
        )
    return cast(ScheduledProvider, bound).samples_between(begin, end)


def _readings(prepared: Prepared, own: slice) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
    plan, steps = prepared.plan, prepared.steps
    offsets, count = row_offsets(plan), own.stop - own.start
    lead = next((s.values.shape[:-2] for s in prepared.record.streams.values()), ())
    readings = np.zeros((*lead, count, offsets[-1]))
    due = np.zeros((count, len(plan.measurements)), dtype=bool)
    interval = np.ones((count, len(plan.measurements)))
    for j, m in enumerate(plan.measurements):
        entry = steps.due[m.name]
        row = entry.row[own]
        due[:, j], interval[:, j] = row >= 0, entry.interval[own]
        if m.stream is not None:
            stream = prepared.record.streams[m.stream]
            columns = _columns(stream.columns, m.columns, m.name)
            there = row >= 0
            readings[..., offsets[j] : offsets[j + 1]] = np.nan
            readings[..., there, offsets[j] : offsets[j + 1]] = stream.values[..., columns][..., row[there], :]
    return readings, due, interval


def _columns(found: tuple[str, ...], wanted: tuple[str, ...], name: str) -> list[int]:
    missing = [c for c in wanted if c not in found]
    if missing:
        raise DataError(
            f"measurement {name!r} needs the column {missing[0]!r}", hint=f"the stream has: {', '.join(found)}"
        )
    return [found.index(c) for c in wanted]
