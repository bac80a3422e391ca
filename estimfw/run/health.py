"""The health of a run: measurements that are refused all the time, and filters whose NIS leaves its bounds.

That is judged of what became of the measurements, after the recursion and outside of it. What only has to be told is judged once,
at the end of the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.health import (
    CAUTIOUS,
    DEGRADED,
    DIVERGED,
    NisJudge,
    NisLimit,
    RejectionJudge,
    RejectionLimit,
    most_counted,
)
from estimfw.config.compose import Problem
from estimfw.config.health import HealthConfig
from estimfw.data.record import Event
from estimfw.plan.plan import MeasurementPlan, Plan

__all__ = ["Judges", "degrees", "health_events", "judges_of", "unless_rejected"]

Bools = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Judges:
    """Of one measurement; None where it is not watched."""

    rejection: RejectionJudge | None
    nis: NisJudge | None


def judges_of(problem: Problem) -> tuple[Judges, ...]:
    """Those of each measurement of the plan, before the first epoch."""
    return tuple(_judges(problem.config.health, problem.plan, m) for m in problem.plan.measurements)


def _judges(health: HealthConfig | None, plan: Plan, m: MeasurementPlan) -> Judges:
    asked, gated = health if health is not None else HealthConfig(), m.gate is not None
    rejection, nis = asked.rejected, asked.divergence
    refused = rejection is not None and gated and (rejection.of is None or m.name in rejection.of)
    watched = nis is not None and (health is not None or gated) and (nis.of is None or m.name in nis.of)
    return Judges(
        RejectionJudge(RejectionLimit(rejection.times, rejection.longer))
        if rejection is not None and refused
        else None,
        NisJudge(NisLimit(nis.epochs, nis.probability, nis.longer), most_counted(plan.thresholds(m)))
        if nis is not None and watched
        else None,
    )


def degrees(plan: Plan, innovation: FloatArray) -> IntArray:
    """Components (K, measurements) behind each NIS: of innovations (K, all rows), NaN where there is none."""
    known, edges = np.isfinite(innovation), np.cumsum([0, *(m.rows for m in plan.measurements)])
    counts = [known[:, a:b].sum(axis=1) for a, b in pairwise(edges.tolist())]
    return np.stack(counts, axis=1).astype(np.int64)


def health_events(
    problem: Problem, time: FloatArray, disposition: IntArray, nis: FloatArray, innovation: FloatArray
) -> Iterator[Event]:
    """One event for each stretch of a whole run in which a measurement was not as it should be.

    Parameters
    ----------
    problem : Problem
    time : (K,) array, s
    disposition, nis : (K, measurements) array
    innovation : (K, all rows) array
    """
    judges = judges_of(problem)
    freedom = degrees(problem.plan, innovation) if judges else np.zeros((time.size, 0), dtype=np.int64)
    for j, (m, one) in enumerate(zip(problem.plan.measurements, judges, strict=True)):
        judged = nis[:, j]
        if one.rejection is not None:
            _, degraded, since = one.rejection.advance(time, disposition[:, j])
            yield from _rejections(m.name, time, disposition[:, j], degraded, since)
            judged = unless_rejected(judged, degraded)
        if one.nis is not None:
            yield from _out_of_bounds(one.nis, m.name, time, judged, freedom[:, j])


def unless_rejected(nis: FloatArray, degraded: Bools) -> FloatArray:
    """The NIS (K,) that say something of the filter's sigmas: one that is refused all the time is another fault."""
    return np.where(degraded, np.nan, nis)


def _rejections(
    name: str, time: FloatArray, disposition: IntArray, degraded: Bools, since: FloatArray
) -> Iterator[Event]:
    known = np.flatnonzero(np.isfinite(since) | (disposition == 0))
    for first, last, ended in _stretches(degraded[known]):
        begin, end = float(since[known[first]]), float(time[known[last]])
        count = int(np.count_nonzero(np.isfinite(since[(time >= begin) & (time <= end)])))
        text = (
            f"rejected each of the {count} times it was due from {begin:.10g} s to {end:.10g} s; "
            f"{f'fused again at {time[known[last + 1]]:.10g} s' if ended else 'so it was to the end'}"
        )
        yield Event(begin, name, DEGRADED, text, count)


def _out_of_bounds(judge: NisJudge, name: str, time: FloatArray, nis: FloatArray, freedom: IntArray) -> Iterator[Event]:
    _, found = judge.advance(time, nis, freedom)
    known = np.flatnonzero(np.isfinite(found.ratio))
    kinds = (
        (DIVERGED, found.high, found.high_since, np.max, "the sigmas are too small, or the model is wrong"),
        (CAUTIOUS, found.low, found.low_since, np.min, "the sigmas are larger than they need be"),
    )
    for kind, flags, since, extreme, means in kinds:
        for first, last, ended in _stretches(flags[known]):
            begin, end = float(since[known[first]]), float(time[known[last]])
            ratio = float(extreme(found.ratio[known[first : last + 1]]))
            until = f"to {end:.10g} s" if ended else "to the end"
            text = (
                f"the mean NIS of {judge.limit.epochs} epochs is {ratio:.3g} times what is expected, out of its bounds from "
                f"{begin:.10g} s {until}: {means}"
            )
            yield Event(begin, name, kind, text, last - first + 1)


def _stretches(flags: Sequence[bool] | Bools) -> Iterator[tuple[int, int, bool]]:
    """First and last of the marked in a row, and whether an unmarked one follows."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))
    starts, ends = np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist()
    for start, end in zip(starts, ends, strict=True):
        yield start, end - 1, end < len(flags)
