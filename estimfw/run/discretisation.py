"""The discretisation study of a composed filter: at its reference nominal, or where its record is at an instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.discretisation_study import DiscretisationStudy, study_discretisation
from estimfw.config.compose import Problem
from estimfw.data.record import SAME, Record
from estimfw.errors import ConfigError, UsageError
from estimfw.estimators.stretch import Stretch
from estimfw.plan.discretisation import Discretisation, Method
from estimfw.run.load import load_record
from estimfw.run.needs_states import refuse_bank, refuse_without_states
from estimfw.run.run import Progress, run_problem

__all__ = ["SigmaChange", "StudiedFilter", "study_filter"]

FloatArray = NDArray[np.float64]

#: What the plan can be run with, by the key of its formula; Phi is exact in all of them.
RUNNABLE: dict[str, tuple[Method, int]] = {
    "first": ("series", 1),
    "second": ("series", 2),
    "third": ("series", 3),
    "held_noise": ("held_noise", 1),
}


@dataclass(frozen=True, slots=True)
class SigmaChange:
    """What a formula does to the sigmas of the filter, against Van Loan.

    ``largest`` is the largest relative change of any sigma after any step, at ``time`` (s), of ``state``; ``end`` the largest
    one after the last step.
    """

    key: str
    largest: float
    state: str
    time: float
    end: float


@dataclass(frozen=True)
class StudiedFilter:
    """``where`` says at which operating point; ``sigmas`` are empty where the filter was not run."""

    name: str
    where: str
    own: str
    study: DiscretisationStudy
    sigmas: tuple[SigmaChange, ...]


def study_filter(
    problem: Problem,
    steps: Sequence[float],
    *,
    at: float | None = None,
    record: bool = True,
    progress: Progress | None = None,
) -> StudiedFilter:
    """Study the process noise of a filter.

    Parameters
    ----------
    problem : Problem
    steps : sequence of float, s
    at : float, optional
        An instant of the record, s: the dynamics are those of the step that holds it (default: the reference nominal).
    record : bool
        Run the filter over its record with each formula too, where it has a source.
    progress : callable, optional
        See `run_problem`.

    Raises
    ------
    EstimfwError
        Of any kind; UsageError where ``at`` lies outside of the record.
    """
    refuse_without_states(problem, "a study of the process noise")
    refuse_bank(problem, "a study of the process noise", "look at one member: estimator: {kind: kalman}, and its start")
    needed = problem.source is not None and (record or at is not None)
    if at is not None and not needed:
        raise ConfigError("--at needs a record, and the config has no source", location=problem.document.locate(()))
    data = load_record(problem) if needed else None
    F, D = _reference(problem) if at is None or data is None else _along(problem, data, at)
    if not np.any(D):
        raise ConfigError(
            "no noise drives the states: there is nothing to discretise", location=problem.document.locate(("process",))
        )
    return StudiedFilter(
        name=str(problem.config.name),
        where="the reference nominal" if at is None else f"{at:.10g} s of the record",
        own=problem.plan.discretisation.describe(),
        study=study_discretisation(problem.plan.states, F, D, steps),
        sigmas=_sigmas(problem, data, progress) if record and data is not None else (),
    )


def _reference(problem: Problem) -> tuple[FloatArray, FloatArray]:
    values = problem.model.nominal(problem.reference)
    return problem.model.F.coefficient.evaluate(values), problem.model.diffusion.evaluate(values)


def _along(problem: Problem, record: Record, at: float) -> tuple[FloatArray, FloatArray]:
    plan, found = problem.plan, list[tuple[FloatArray, FloatArray]]()

    def look(stretch: Stretch) -> None:
        begin = stretch.time - stretch.chunk.dt
        inside = np.flatnonzero((begin - SAME <= at) & (at <= stretch.time + SAME))
        if inside.size and not found:
            row = stretch.rows[0][inside[0]]
            found.append((plan.F.evaluate(row), plan.D.evaluate(row)))

    done = run_problem(replace(problem, truth=None), record=record, watch=lambda prepared: [look])
    if not found:
        steps = done.prepared.steps
        span = f"the run goes from {steps.start:.10g} to {steps.time[-1]:.10g} s"
        raise UsageError(f"--at {at:.10g} s lies outside the run", hint=span)
    return found[0]


def _sigmas(problem: Problem, record: Record, progress: Progress | None) -> tuple[SigmaChange, ...]:
    """One run for each formula; what they differ by is Q alone."""

    def run(made: Discretisation) -> tuple[FloatArray, FloatArray]:
        plan = replace(problem.plan, discretisation=made)
        done = run_problem(replace(problem, plan=plan, truth=None), progress, record)
        return done.sigma, done.prepared.steps.time

    own = problem.plan.discretisation
    exact, time = run(replace(own, method="van_loan"))
    found = []
    for key, (method, order) in RUNNABLE.items():
        sigma, _ = run(Discretisation(method, 12, order, own.evaluation))
        with np.errstate(divide="ignore", invalid="ignore"):
            change = np.where(exact > 0.0, np.abs(sigma / exact - 1.0), 0.0)
        k, i = np.unravel_index(int(np.argmax(change)), change.shape)
        most = float(change[k, i])
        found.append(SigmaChange(key, most, problem.plan.states[i], float(time[k]), float(np.max(change[-1]))))
    return tuple(found)
