"""Runs of suboptimal forms: what they estimate, against filters written down here, and the true sigma beside their own."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.analysis.suboptimal import LinearStep, linear_steps, priced
from estimfw.config.compose import Problem
from estimfw.estimators.stretch import Stretch
from estimfw.plan.separation import Form
from estimfw.run.dataset import result_dataset
from estimfw.run.load import load_record
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]
Alignment = Callable[..., Problem]
Nodes = Callable[[Sequence[str]], list[dict[str, object]]]

AXES = [
    "velocity[x] tilt[y] accel_bias[x] gyro_drift[y] gyro_drift[z]",
    "velocity[y] tilt[x] azimuth accel_bias[y] gyro_drift[x]",
]


def steps_of(problem: Problem) -> tuple[list[LinearStep], FloatArray, FloatArray]:
    """The linear steps of a run, and the prior."""
    kept: list[LinearStep] = []

    def see(stretch: Stretch) -> None:
        kept.extend(linear_steps(stretch))

    done = run_problem(problem, watch=lambda _: [see])
    return kept, *done.prepared.prior


def groups(problem: Problem) -> list[tuple[int, ...]]:
    assert problem.plan.subsystems is not None
    return [node.states for node in problem.plan.subsystems.nodes]


@pytest.mark.parametrize("form", ["drop", "decoupled"])
def test_own_and_true_sigma_of_a_run_are_the_analysed_ones(alignment: Alignment, nodes: Nodes, form: Form) -> None:
    problem = alignment({"kind": "decentralised", "nodes": nodes(AXES), "cross_covariance": form}, 150)
    run = run_problem(problem)
    wanted = priced(form, groups(problem), *steps_of(alignment({"kind": "kalman"}, 150)))
    assert run.honest is not None
    np.testing.assert_allclose(run.sigma, wanted.own, rtol=1e-6)
    np.testing.assert_allclose(run.honest.sigma, wanted.true, rtol=1e-6)
    made = result_dataset(run)
    np.testing.assert_array_equal(made["honest_sigma"], run.honest.sigma)


def naive(form: Form, problem: Problem, steps: list[LinearStep], x: FloatArray, P: FloatArray) -> FloatArray:
    """Estimates (K, n) of the form on the readings of the problem's own record."""
    of = np.array([next(i for i, g in enumerate(groups(problem)) if s in g) for s in range(10)])
    within, kept = of[:, None] == of, []
    for step, z in zip(steps, load_record(problem).streams["zero_velocity"].values, strict=True):
        Phi = np.where(within | (form == "drop"), step.Phi, 0.0)
        x, P = Phi @ x, np.where(within, Phi @ np.where(within, P, 0.0) @ Phi.T + step.Q, 0.0)
        nu = z - step.H @ x
        for row, h in enumerate(step.H):
            own, K = of == of[int(np.argmax(h))], np.zeros(10)
            s = h @ P @ h + step.R[row, row]
            K[own] = (P @ h)[own] / s
            x, P = x + K * nu[row], P - s * np.outer(K, K)
        kept.append(x)
    return np.array(kept)


@pytest.mark.parametrize("form", ["drop", "decoupled"])
def test_estimates_are_those_of_filters_that_keep_no_covariance_between_them(
    alignment: Alignment, nodes: Nodes, form: Form
) -> None:
    problem = alignment({"kind": "decentralised", "nodes": nodes(AXES), "cross_covariance": form}, 100)
    run = run_problem(problem)
    wanted = naive(form, problem, *steps_of(alignment({"kind": "kalman"}, 100)))
    assert np.abs((run.estimate - wanted) / run.sigma).max() < 1e-9


def test_an_exact_filter_has_no_other_truth(alignment: Alignment, nodes: Nodes) -> None:
    assert alignment({"kind": "decentralised", "nodes": nodes(AXES)}, 10).truth is None
