"""Error model, provider and measurement say the same: a disturbed nominal shows the innovation that H and Phi predict."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.kernels.fuse import nearest
from estimfw.plan.plan import MeasurementPlan
from estimfw.testing.first_steps import FirstSteps, first_steps

__all__ = ["check_measurements"]

FloatArray = NDArray[np.float64]
#: Disturbance in SI: small enough for first order, large enough against rounding.
SIZE = 1e-5


def check_measurements(problem: Problem, tolerance: float = 1e-3) -> None:
    """Move the nominal by a correction, step, and compare the innovations with ``-H Phi dx``.

    Checks for every state that corrects the provider, over one step of the filter's record: that the innovation is what H
    says of the error states, that the dynamics are those of the provider, and that ``correct`` has the right sign.

    Parameters
    ----------
    problem : Problem
        Its provider must be equivalent to the model (no ``allow_mismatch``).
    tolerance : float
        Largest difference, of the largest innovation that any state can cause in the measurement: terms of the error model
        that were dropped for being smaller than that pass.

    Raises
    ------
    AssertionError
        Naming measurement and state.
    """
    first = first_steps(problem, 1)
    if first is None:
        return
    process, end = _rows(problem, first, first.state)
    doublings = problem.plan.discretisation.doublings(problem.plan.F.evaluate(process), float(first.dt[0]))
    Phi = problem.plan.discretised(process, first.inputs[0], first.dt[0], doublings)[0]
    correction = SIZE * problem.plan.correction.evaluate(problem.plan.layout.complete(first.row))
    for state in np.flatnonzero(problem.plan.corrected):
        _, moved = _rows(problem, first, first.provider.correct(first.state, correction[:, state]))
        for m in problem.plan.measurements:
            seen = nearest(_innovation(m, moved), _innovation(m, end), m.period) - _innovation(m, end)
            H = m.H.evaluate(end)
            expected = -H @ Phi[:, state] * SIZE
            worst = float(np.max(np.abs(seen - expected), initial=0.0))
            scale = SIZE * float(np.max(np.abs(H @ Phi), initial=0.0))
            assert worst <= tolerance * scale, (
                f"measurement {m.name}: correcting {problem.plan.states[state]} by {SIZE:g} moves the innovation by {seen}, "
                f"H Phi says {expected}"
            )


def _rows(problem: Problem, first: FirstSteps, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Complete process row and end row after the first sample."""
    _, process, end = first.provider.step(state, first.samples[0])
    return problem.plan.layout.complete(process), problem.plan.layout.complete(end)


def _innovation(m: MeasurementPlan, row: FloatArray) -> FloatArray:
    return np.asarray(m.innovation.evaluate(row)[..., 0])
