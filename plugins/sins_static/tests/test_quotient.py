"""The 7-state filter is the exact observable quotient of the 10-state one: x7 = T x10, whatever the attitude."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.model.coefficient import identity
from estimfw.model.prior import Prior
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]

BEFORE = (
    "sins_static.constant_specific_force",
    "sins_static.bias_in_navigation_frame",
    "sins_static.remove_vertical_channel",
)
GYRO_BIAS = np.radians(0.01 / 3600.0)


def correlated_prior() -> FloatArray:
    """A full P0 (10, 10): the experiment's sigmas, correlated at random (fixed)."""
    sigma = np.array([0.1] * 2 + [np.radians(10.0)] * 3 + [100.0 * 9.80665e-6] * 2 + [GYRO_BIAS] * 3)
    A = np.eye(10) + 0.3 * np.random.default_rng(7).standard_normal((10, 10))
    P = A @ A.T
    scale = sigma / np.sqrt(np.diag(P))
    return np.asarray(P * np.outer(scale, scale))


def with_prior(problem: Any, covariance: FloatArray) -> Any:
    n = len(covariance)
    rows = tuple(tuple(float(x) for x in row) for row in covariance)
    return replace(problem, plan=replace(problem.plan, prior=Prior((0.0,) * n, rows, identity(n))))


@pytest.fixture(scope="module")
def pair(
    composed: Callable[..., Any], quotient: Callable[..., FloatArray]
) -> Callable[..., tuple[Any, Any, FloatArray]]:
    """The 10- and the 7-state problem with n-frame biases, with or without Coriolis in both, and T."""

    def make(coriolis: bool, *overrides: str) -> tuple[Any, Any, FloatArray]:
        def policies(names: Sequence[str]) -> str:
            first = () if coriolis else ("sins_static.remove_coriolis",)
            return f"policies=[{', '.join((*first, *names))}]"

        ten = composed("static_12", policies(BEFORE), *overrides)
        seven = composed("static_12", policies((*BEFORE, "sins_static.prune_unobservable")), *overrides)
        assert (len(ten.plan.states), len(seven.plan.states)) == (10, 7)
        return ten, seven, quotient(ten.plan.states, seven.plan.states, ten.reference)

    return make


@pytest.mark.parametrize("coriolis", [False, True])
def test_dynamics_and_measurement_commute_with_the_quotient(coriolis: bool, pair: Callable[..., Any]) -> None:
    ten, seven, T = pair(coriolis)

    def matrices(problem: Any) -> tuple[FloatArray, FloatArray]:
        F = problem.model.F.coefficient.evaluate(problem.reference)
        return F, problem.model.H("zero_velocity").coefficient.evaluate(problem.reference)

    (F_10, H_10), (F_7, H_7) = matrices(ten), matrices(seven)
    np.testing.assert_allclose(T @ F_10, F_7 @ T, rtol=0.0, atol=1e-20)
    np.testing.assert_array_equal(H_10, H_7 @ T)


@pytest.mark.parametrize(("kernel", "coriolis"), [("numpy", False), ("numba", False), ("numba", True)])
@pytest.mark.parametrize(
    ("attitude", "misalignment"),
    [((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), ((40.0, 20.0, -30.0), (10.0, -5.0, 8.0)), ((-170.0, -60.0, 90.0), (3.0, 9.0, 1.0))],
)  # fmt: skip
def test_seven_states_estimate_exactly_the_combinations_of_the_ten(
    kernel: str, coriolis: bool, attitude: tuple[float, float, float], misalignment: tuple[float, float, float],
    pair: Callable[..., Any], misaligned: Callable[..., str],
) -> None:  # fmt: skip
    angles = (f"initial_attitude.{n}={a} deg" for n, a in zip(("yaw", "pitch", "roll"), attitude, strict=True))
    ten, seven, T = pair(coriolis, *angles, misaligned(*misalignment), f"estimator.kernel={kernel}")
    P = correlated_prior()
    from_ten, from_seven = run_problem(with_prior(ten, P)), run_problem(with_prior(seven, T @ P @ T.T))
    np.testing.assert_allclose(from_seven.innovation, from_ten.innovation, rtol=0.0, atol=1e-11)
    phi = np.degrees(from_ten.estimate @ T.T - from_seven.estimate)[:, 2:5]
    assert np.max(np.abs(phi)) < 1e-9
    last = T @ from_ten.covariance[-1] @ T.T
    scale = np.sqrt(np.diag(last))
    np.testing.assert_allclose(
        from_seven.covariance[-1] / np.outer(scale, scale), last / np.outer(scale, scale), atol=1e-6
    )


def test_prior_correlations_of_a_config_reach_the_filter(composed: Callable[..., Any]) -> None:
    entry = "{between: ['attitude_error[E]', 'attitude_error[N]'], value: 0.4}"
    problem = composed("static_7", f"prior.correlations=[{entry}]")
    _, covariance = problem.plan.prior.evaluate(problem.reference)
    first = problem.plan.states.index("attitude_error[E]")
    assert covariance[first, first + 1] == pytest.approx(0.4 * np.radians(10.0) ** 2)
