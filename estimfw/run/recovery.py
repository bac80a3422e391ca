"""What is done, while a filter runs, about a measurement that is refused all the time, and about divergence.

A stretch of steps is run as usual; where it turns out that something was due after one of its steps, it ends there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import Event
from estimfw.errors import NumericalError
from estimfw.estimators.scan import ChunkResult, FilterState
from estimfw.kernels import joseph, ud
from estimfw.plan.plan import MeasurementPlan, Plan
from estimfw.run.health import Judges, degrees, judges_of, unless_rejected
from estimfw.run.prepare import Begun, Prepared

__all__ = ["Act", "Recovery", "acts", "inflated"]

FloatArray = NDArray[np.float64]

#: So many states are named in a message.
MOST_STATES = 6


@dataclass(frozen=True, slots=True)
class Act:
    """What is due after so many ``steps`` of a stretch: ``inflate`` or ``restart``, for these measurements (places)."""

    steps: int
    then: str
    measurements: tuple[int, ...]


def acts(problem: Problem) -> bool:
    """Whether the health of a filter can change its run."""
    health = problem.config.health
    if health is None:
        return False
    rejected, divergence = health.rejected, health.divergence
    return (rejected is not None and rejected.then != "flag") or (divergence is not None and divergence.strict)


def inflated(problem: Problem, state: FilterState, prior: FloatArray, act: Act) -> FilterState:
    """The state with the prior covariance of all states that the measurements read added to theirs.

    Notes
    -----
    P + E P_0 E', with E the states read: what the filter is sure of may be off by as much as it could be at the start. A sum of
    covariances is one, and the gains of the next epochs open as far as those of the first ones.
    """
    kernel = _kernel(problem)
    read = sorted({i for j in act.measurements for i in _states_read(problem.plan, problem.plan.measurements[j])})
    covariance = kernel.covariance(state.form).copy()
    covariance[np.ix_(read, read)] += prior[np.ix_(read, read)]
    return replace(state, form=kernel.factor(covariance))


def _kernel(problem: Problem) -> ModuleType:
    return ud if problem.estimator.covariance == "ud" else joseph


def _states_read(plan: Plan, m: MeasurementPlan) -> list[int]:
    return sorted({entry % len(plan.states) for entry, _, _ in m.H.monomials})


class Recovery:
    """Judges a run stretch by stretch, and says where something is due.

    Attributes
    ----------
    restart : bool
        The filter starts anew before the next step.
    events : list of Event
    """

    def __init__(self, problem: Problem, judges: Sequence[Judges] | None = None) -> None:
        self.problem, self.judges = problem, tuple(judges) if judges is not None else judges_of(problem)
        self.restart, self.events = False, list[Event]()
        self._done = 0

    def due(self, time: FloatArray, result: ChunkResult) -> Act | None:
        """The first thing that is due within these K steps; the judges are then as they are after it, else as after all.

        Raises
        ------
        NumericalError
            The config wants the run to stop.
        """
        health = self.problem.config.health
        assert health is not None
        then = health.rejected.then if health.rejected is not None else "flag"
        strict = health.divergence is not None and health.divergence.strict
        freedom = degrees(self.problem.plan, result.innovation)
        after, first, high = self._advanced(time, result, freedom, time.size)
        at = min(first) if then != "flag" else time.size
        worst = min(high) if strict else time.size
        if worst < time.size and worst <= at:
            self._refuse_diverged(high.index(worst), worst, time, result, freedom)
        if at == time.size:
            self.judges, self._done = after, self._done + time.size
            return None
        which = tuple(j for j, k in enumerate(first) if k == at)
        if then == "stop":
            self._refuse_rejected(which[0], at, time, result, freedom)
        self.judges, _, _ = self._advanced(time, result, freedom, at + 1)
        self.judges = tuple(
            Judges(one.rejection.anew(), one.nis.anew() if one.nis is not None else None)
            if one.rejection is not None and j in which
            else one
            for j, one in enumerate(self.judges)
        )
        self._done += at + 1
        return Act(at + 1, then, which)

    def acted(
        self,
        members: Sequence[Prepared | Begun],
        states: list[FilterState],
        covariances: list[FloatArray],
        act: Act,
        time: float,
    ) -> tuple[list[FilterState], list[FloatArray]]:
        """States and covariances of all members of a bank after what is done at this instant (s)."""
        self.events.append(self._told(act, time))
        if act.then == "restart":
            self.restart = True
            return states, covariances
        made = [inflated(self.problem, state, one.prior[1], act) for one, state in zip(members, states, strict=True)]
        return made, [_kernel(self.problem).covariance(state.form) for state in made]

    def _told(self, act: Act, time: float) -> Event:
        plan, names = self.problem.plan, [self.problem.plan.measurements[j].name for j in act.measurements]
        read = [plan.states[i] for j in act.measurements for i in _states_read(plan, plan.measurements[j])]
        done = {
            "inflate": f"the prior covariance of {', '.join(dict.fromkeys(read))} is added to that of the estimate",
            "restart": "the filter starts anew from its prior",
        }[act.then]
        return Event(time, names[0], "recovery", f"{' and '.join(names)} refused all the time: {done}")

    def _advanced(
        self, time: FloatArray, result: ChunkResult, freedom: NDArray[np.int64], count: int
    ) -> tuple[tuple[Judges, ...], list[int], list[int]]:
        """The judges after the first ``count`` steps, and for each measurement the first step that is degraded, and diverged."""
        own, made, first, high = slice(0, count), list[Judges](), list[int](), list[int]()
        for j, one in enumerate(self.judges):
            rejection, nis, bad, far = one.rejection, one.nis, np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
            seen = result.nis[own, j]
            if rejection is not None:
                rejection, bad, _ = rejection.advance(time[own], result.disposition[own, j])
                seen = unless_rejected(seen, bad)
            if nis is not None:
                nis, judged = nis.advance(time[own], seen, freedom[own, j])
                far = judged.high
            made.append(Judges(rejection, nis))
            first.append(int(np.argmax(bad)) if bad.any() else time.size)
            high.append(int(np.argmax(far)) if far.any() else time.size)
        return tuple(made), first, high

    def _refuse_diverged(
        self, j: int, k: int, time: FloatArray, result: ChunkResult, freedom: NDArray[np.int64]
    ) -> None:
        judges, _, _ = self._advanced(time, result, freedom, k + 1)
        judge, m = judges[j].nis, self.problem.plan.measurements[j]
        assert judge is not None
        ratio = float(np.mean(judge.nis) / np.mean(judge.freedom))
        raise NumericalError(
            f"the filter diverged at step {self._done + k + 1} (t = {time[k]:.10g} s): the mean NIS of {m.name} is {ratio:.3g} "
            f"times what is expected since {judge.high[1]:.10g} s; {self._state_text(j, k, result)}",
            hint=_good(judge.good),
        )

    def _refuse_rejected(
        self, j: int, k: int, time: FloatArray, result: ChunkResult, freedom: NDArray[np.int64]
    ) -> None:
        judges, _, _ = self._advanced(time, result, freedom, k + 1)
        judge, m = judges[j].rejection, self.problem.plan.measurements[j]
        assert judge is not None
        raise NumericalError(
            f"{m.name} was rejected {judge.count} times in a row, up to step {self._done + k + 1} (t = {time[k]:.10g} s); "
            f"{self._state_text(j, k, result)}",
            hint=f"last good before {judge.since:.10g} s; health.rejected.then: inflate or restart goes on",
        )

    def _state_text(self, j: int, k: int, result: ChunkResult) -> str:
        """The states that a measurement reads, with their sigmas."""
        plan = self.problem.plan
        read = _states_read(plan, plan.measurements[j])
        sigma = np.sqrt(np.maximum(np.diag(result.covariance[k])[read], 0.0)).tolist()
        told = [f"{plan.states[i]} = {result.estimate[k, i]:.6g} +- {s:.3g}" for i, s in zip(read, sigma, strict=True)]
        return ", ".join([*told[:MOST_STATES], *(["..."] if len(told) > MOST_STATES else [])])


def _good(time: float) -> str:
    return f"within bounds last at {time:.10g} s" if np.isfinite(time) else "it never was within bounds"
