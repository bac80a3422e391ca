"""The design matrix of a measurement is the derivative of its innovation, on whatever manifold the nominal lives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.estimators.unscented_scan import Manifold, manifold_of
from estimfw.kernels.fuse import nearest
from estimfw.testing.first_steps import FirstSteps, first_steps

__all__ = ["check_jacobians"]

FloatArray = NDArray[np.float64]

#: Weights of f(-2 h), f(-h), f(h), f(2 h): the derivative to h^4.
STENCIL = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
PLACES = np.array([-2.0, -1.0, 1.0, 2.0])


def check_jacobians(problem: Problem, tolerance: float = 1e-8, step: float = 1e-3, steps: int = 5) -> None:
    """Move the nominal by its own ``correct`` along every state that corrects it, and compare innovations with H.

    Along the first steps of the filter's record, by central differences of fourth order. How far a moved nominal is away at the
    end of a step is told by its provider's ``difference``, so nothing is taken from the error model: H alone is judged, also
    where the dynamics are approximate.

    Parameters
    ----------
    problem : Problem
        A measurement without an innovation is left out: it reads no nominal.
    tolerance : float
        Largest difference, of the largest entry of the measurement's H over these states.
    step : float
        Disturbance in SI, of each state.
    steps : int
        Of the record.

    Raises
    ------
    AssertionError
        Naming measurement, row and state.
    PluginError
        The provider has no ``difference``.
    """
    first = first_steps(problem, steps)
    if first is None or not any(problem.plan.corrected):
        return
    manifold, state, row = manifold_of(first.provider), first.state, first.row
    for k in range(first.samples.shape[0]):
        after, _, end = first.provider.step(state, first.samples[k])
        _check(problem, first, manifold, (state, row, k, after, end), tolerance, step)
        state, row = after, end


def _check(
    problem: Problem,
    first: FirstSteps,
    manifold: Manifold,
    at: tuple[FloatArray, FloatArray, int, FloatArray, FloatArray],
    tolerance: float,
    step: float,
) -> None:
    state, row, k, after, end = at
    layout, plan = problem.plan.layout, problem.plan
    live = np.flatnonzero(plan.corrected)
    moved = step * plan.correction.evaluate(layout.complete(row))[:, live].T[:, None, :] * PLACES[:, None]
    states = first.provider.correct(np.broadcast_to(state, (*moved.shape[:-1], state.size)), moved)
    samples = np.broadcast_to(first.samples[k], (*moved.shape[:-1], first.samples.shape[1]))
    there, _, rows = first.provider.step(states, samples)
    end = layout.complete(end)
    off = _slope(manifold.difference(np.broadcast_to(after, there.shape), there), step)  # (states, 3 * slots)
    error = (
        off @ np.linalg.pinv(plan.correction.evaluate(end)[:, live]).T
    )  # by which states the nominal is off, for each
    for m in plan.measurements:
        if not m.innovation.monomials:
            continue
        own = m.innovation.evaluate(layout.complete(rows))[..., 0]
        seen = _slope(nearest(own, own[:, :1], m.period), step)
        H = m.H.evaluate(end)[:, live]
        # Taking an error off the nominal lowers the innovation by H times it: seen = -error H'.
        slopes = np.asarray(-np.linalg.solve(error, seen).T, dtype=float)
        worst = np.abs(slopes - H)
        assert np.max(worst, initial=0.0) <= tolerance * max(float(np.max(np.abs(H), initial=0.0)), 1e-300), _told(
            problem, m.labels, live, slopes, H, k
        )


def _slope(values: FloatArray, step: float) -> FloatArray:
    """Derivative of values (states, places, k) to the disturbance, (states, k)."""
    return np.asarray(np.einsum("spk,p->sk", values, STENCIL) / step)


def _told(
    problem: Problem, labels: tuple[str, ...], live: NDArray[np.int64], slopes: FloatArray, H: FloatArray, k: int
) -> str:
    i, j = np.unravel_index(int(np.argmax(np.abs(slopes - H))), H.shape)
    return (
        f"{labels[i]}: H over {problem.plan.states[live[j]]} is {H[i, j]:.12g}, finite differences of the innovation say "
        f"{slopes[i, j]:.12g} (step {k + 1})"
    )
