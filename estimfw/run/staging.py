"""A filter going through its stages: which steps each has, and the recursion and the belief when one begins."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.timeline import Due, Steps
from estimfw.errors import ConfigError
from estimfw.estimators.belief import Belief
from estimfw.estimators.scan import FilterState
from estimfw.kernels import joseph, ud
from estimfw.plan.plan import Plan
from estimfw.plan.stages import measured_steps, stage_of_steps
from estimfw.run.kernel_choice import Scan

__all__ = ["StagedFilter", "stage_chunks", "staged_steps", "stages_json"]

FloatArray = NDArray[np.float64]


def staged_steps(problem: Problem, steps: Steps) -> Steps:
    """The steps, with nothing due that its stage does not measure.

    Raises
    ------
    ConfigError
        A stage has no steps: it does not lie inside the record. Or the run restarts, which a filter with stages does not.
    """
    stages = problem.plan.stages
    if not stages:
        return steps
    which = stage_of_steps(stages, steps.begin)
    for i, stage in enumerate(stages):
        if not np.any(which == i):
            end = next(s.until for s in (stage, *stages[i - 1 :: -1]) if s.until is not None)
            raise ConfigError(
                f"stage {stage.name!r} has no steps: the run goes from {steps.start:.10g} to {steps.time[-1]:.10g} s",
                location=problem.document.locate(("estimator", "stages", i, "until")),
                hint=f"it {'ends' if stage.until is not None else 'begins'} at {end:.10g} s, in the time of the record",
            )
    if np.any(steps.restart):
        at = float(steps.begin[int(np.argmax(steps.restart))])
        raise ConfigError(
            f"a monitor restarts the filter at {at:g} s, and a filter with stages does not restart",
            location=problem.document.locate(("monitors",)),
        )
    due, measured = {}, measured_steps(stages, steps.begin)
    for j, m in enumerate(problem.plan.measurements):
        due[m.name] = Due(np.where(measured[:, j], steps.due[m.name].row, -1), steps.due[m.name].interval)
    return replace(steps, due=due)


def stage_chunks(plan: Plan, steps: Steps, length: int) -> Iterator[tuple[int, int, int | None]]:
    """First and last (not included) of at most ``length`` steps of one stage; and the stage where it begins there, else None."""
    which = stage_of_steps(plan.stages, steps.begin)
    edges = [0, *(np.flatnonzero(np.diff(which)) + 1).tolist(), len(steps)]
    for begin, end in pairwise(edges):
        for first in range(begin, end, length):
            entered = int(which[begin]) if plan.stages and first == begin else None
            yield first, min(first + length, end), entered


def stages_json(plan: Plan, steps: Steps) -> list[dict[str, Any]]:
    """For results and reports: what was believed from when to when (s); ``held`` and ``considered`` are states."""
    which = stage_of_steps(plan.stages, steps.begin)
    begin = steps.begin

    def named(flags: tuple[bool, ...], names: Iterable[str]) -> list[str]:
        return [name for name, own in zip(names, flags, strict=True) if own]

    return [
        {
            "name": stage.name,
            "begin": float(begin[which == i][0]),
            "end": float(steps.time[which == i][-1]),
            "steps": int(np.count_nonzero(which == i)),
            "held": named(stage.held, plan.states),
            "considered": named(stage.considered, plan.states),
            "measurements": named(stage.measured, (m.name for m in plan.measurements)),
        }
        for i, stage in enumerate(plan.stages)
    ]


class StagedFilter:
    """One filter on its way through the stages of its plan; of a plan without stages the filter itself.

    Parameters
    ----------
    problem : Problem
    scan : Scan
        Of the whole plan.
    prior : (n, n) array
        Covariance at the start.

    Attributes
    ----------
    scan : Scan
        The recursion of the stage.
    plan : Plan
        What it runs.
    """

    def __init__(self, problem: Problem, scan: Scan, prior: FloatArray) -> None:
        self.scan, self.plan = scan, problem.plan
        self._whole, self._belief = scan, Belief.before_all(prior)
        self._kernel = ud if problem.estimator.covariance == "ud" else joseph

    def enter(self, index: int, state: FilterState) -> tuple[FilterState, FloatArray]:
        """Begin a stage: the state in it, and its covariance (n, n). The estimate is not changed by a change of belief."""
        stage = self._whole.plan.stages[index]
        if index:
            self._belief = replace(self._belief, covariance=self._kernel.covariance(state.form))
        before, self._belief = self._belief, self._belief.changed(np.array(stage.held))
        self.scan = self._whole.in_stage(stage)
        self.plan = self.scan.plan
        if index and np.array_equal(before.held, self._belief.held):
            return state, before.covariance
        return replace(state, form=self._kernel.factor(self._belief.covariance)), self._belief.covariance
