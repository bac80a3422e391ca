"""That a truncated series for Q is no covariance at the steps of a run: told before the run, for the numbers do not show it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.discretisation_study import INDEFINITE, smallest_eigenvalue
from estimfw.data.record import Event
from estimfw.estimators.scan import SubSteps
from estimfw.kernels.discretise import van_loan
from estimfw.plan.plan import Plan

__all__ = ["INDEFINITE_NOISE", "indefinite_noise"]

FloatArray = NDArray[np.float64]

INDEFINITE_NOISE = "indefinite Q"
"""Kind of the event."""

#: Of a log whose steps all differ in length so many are looked at, evenly spread over them.
MOST_LENGTHS = 9


def indefinite_noise(plan: Plan, row: FloatArray, dt: FloatArray, doublings: SubSteps) -> tuple[Event, ...]:
    """One event for the step length at which Q is worst, none where it is a covariance at all of them.

    Parameters
    ----------
    plan : Plan
    row : (provided,) array
        The nominal at the start, at which Q is looked at.
    dt : (K,) array, s
        Lengths of the steps.
    doublings : callable
        Sub-steps of a step of a given length.
    """
    d = plan.discretisation
    if d.method != "series" or d.q_order == 1 or not plan.states:
        return ()
    complete, lengths = plan.layout.complete(row), np.unique(dt[dt > 0.0])
    picked = np.unique(np.linspace(0, lengths.size - 1, min(lengths.size, MOST_LENGTHS)).round().astype(np.int64))
    found = [(_smallest(plan, complete, float(t), doublings(float(t))), float(t)) for t in lengths[picked]]
    worst, length = min(found, default=(0.0, 0.0))
    if not worst < INDEFINITE:
        return ()
    text = (
        f"the series of order {d.q_order} for Q is no covariance at steps of {length:g} s: its smallest eigenvalue "
        f"is {worst:.3g} in units of the exact variances, so sigmas may come out too small. Use discretisation.method: van_loan"
    )
    return (Event(float("nan"), "discretisation", INDEFINITE_NOISE, text),)


def _smallest(plan: Plan, row: FloatArray, dt: float, doublings: int) -> float:
    F, D, step = plan.F.evaluate(row), plan.D.evaluate(row), np.array(dt)
    nothing = np.zeros(len(plan.states))
    exact, made = (
        van_loan(F, D, nothing, step, doublings)[1],
        plan.discretisation.apply(F, D, nothing, step, doublings)[1],
    )
    return smallest_eigenvalue(made, np.diag(exact)) if np.all(np.isfinite(made)) else 0.0
