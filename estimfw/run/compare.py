"""A price list of filters: what each costs and what it gives, all of them on one record with one noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from estimfw.analysis.cost import StepCost, step_cost
from estimfw.analysis.speed_up import Link
from estimfw.config.compose import Problem
from estimfw.data.record import SAME
from estimfw.errors import ConfigError, UsageError
from estimfw.registry.registry import Registry
from estimfw.run.contenders import Contender, Point, refuse_other_records
from estimfw.run.cost import Costed, cost_of_filter
from estimfw.run.dataset import result_dataset
from estimfw.run.load import source_record
from estimfw.run.prepare import Prepared, prepare
from estimfw.run.preprocess import preprocessed
from estimfw.run.run import Collected, run_problem
from estimfw.run.step_time import StepTime, step_times

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Comparison", "Priced", "compare"]

#: Counting needs no link: all nodes in one process.
NO_LINK = Link(0.0, 0.0, 1e-9)


@dataclass(frozen=True, slots=True)
class Priced:
    """What a filter costs.

    ``cost`` is that of one of the ``members`` of a bank, ``time`` that of all. ``reason`` says why it is (not)
    time-invariant, ``in_segments`` that it is so between a few instants at least; ``policies`` are (name, kind) of what made it.
    ``work`` has the multiplications of each form of a filter with nodes.
    """

    name: str
    title: str
    cost: StepCost
    time: StepTime
    time_invariant: bool
    in_segments: bool
    reason: str
    members: int
    policies: tuple[tuple[str, str], ...]
    work: Costed | None = None


@dataclass(frozen=True)
class Comparison:
    """Filters, the points of the grid, and the result of each filter at each point.

    Attributes
    ----------
    title : str
        Of the first config.
    filters : tuple of Priced
        Costs are those at the first point.
    points : tuple of Point
    results : tuple of tuple of xarray.Dataset
        By point, then by filter.
    repeats : int
        Of the measured times.
    """

    title: str
    filters: tuple[Priced, ...]
    points: tuple[Point, ...]
    results: tuple[tuple[xr.Dataset, ...], ...]
    repeats: int


def compare(
    contenders: Sequence[Contender],
    points: Sequence[Point],
    registry: Registry,
    repeats: int = 15,
    times: Sequence[float] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Run every filter at every point, and time them by turns at the first.

    Parameters
    ----------
    contenders : sequence of Contender
        The first one's source makes the record, at each point anew.
    points : sequence of Point
    registry : Registry
    repeats : int
        Of the timing.
    times : sequence of float, s
        Instants that somebody will ask for: one outside the first filter's run is refused before anything runs.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    EstimfwError
        A config is refused, or brings a record of its own; a time lies outside the run.
    """
    composed = [[one.compose(registry, point.overrides) for one in contenders] for point in points]
    for problems in composed:
        refuse_other_records(contenders, problems)
        for problem in problems:
            _refuse_other_estimator(problem)
    priced: tuple[Priced, ...] = ()
    results: list[tuple[xr.Dataset, ...]] = []
    for problems in composed:
        record, runs = source_record(problems[0]), []
        if times and not results:
            _refuse_outside(times, prepare(problems[0], preprocessed(problems[0], record)))
        for problem in problems:
            runs.append(run_problem(problem, record=preprocessed(problem, record)))
            if progress is not None:
                progress(len(results) * len(contenders) + len(runs), len(points) * len(contenders))
        priced = priced or _priced(contenders, runs, repeats)
        results.append(tuple(result_dataset(done) for done in runs))
    return Comparison(composed[0][0].config.name or contenders[0].name, priced, tuple(points), tuple(results), repeats)


def _refuse_outside(times: Sequence[float], prepared: Prepared) -> None:
    first, last = float(prepared.steps.time[0]), float(prepared.steps.time[-1])
    for at in times:
        if not first - SAME <= at <= last + SAME:
            raise UsageError(
                f"--at {at:.10g} s lies outside the run", hint=f"the run goes from {first:.10g} to {last:.10g} s"
            )


def _priced(contenders: Sequence[Contender], runs: Sequence[Collected], repeats: int) -> tuple[Priced, ...]:
    times = step_times([done.prepared for done in runs], repeats)
    problems: list[Problem] = [done.prepared.problem for done in runs]
    return tuple(
        Priced(
            name=one.name,
            title=problem.config.name or one.name,
            cost=_cost(problem),
            time=time,
            time_invariant=problem.plan.time_invariant,
            in_segments=all(change == "stepped" for _, _, change in problem.plan.varying),
            reason=problem.plan.reason,
            members=len(done.prepared.members),
            policies=tuple((c.policy, c.kind) for c in problem.changes),
            work=_work(problem),
        )
        for one, done, problem, time in zip(contenders, runs, problems, times, strict=True)
    )


def _refuse_other_estimator(problem: Problem) -> None:
    if problem.estimator.kind not in {"kalman", "decentralised"}:
        raise ConfigError(
            f"a comparison counts the work of Kalman filters, and {problem.config.name!r} is {problem.estimator.kind}",
            location=problem.document.locate(("estimator", "kind")),
            hint="estimfw trial tells whose errors are smaller; or compare with estimator: {kind: kalman}",
        )


def _cost(problem: Problem) -> StepCost:
    """Of nodes the work of all of them together."""
    layout = problem.plan.layout
    row = layout.complete(layout.pack(problem.reference))
    if problem.plan.subsystems is None:
        return step_cost(problem.plan, problem.estimator.covariance, row)
    cut = cost_of_filter(problem, NO_LINK, counted=False).cut
    assert cut is not None
    cost, by_pattern = step_cost(problem.plan, "joseph", row), cut.products("decentralised_pattern")
    return replace(cost, predict=by_pattern - cost.update, as_run=cut.products("decentralised"))


def _work(problem: Problem) -> Costed | None:
    """Each form of the filter's step, of one with nodes."""
    return cost_of_filter(problem, NO_LINK) if problem.plan.subsystems is not None else None
