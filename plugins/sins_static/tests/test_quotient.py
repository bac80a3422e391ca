"""mode: quotient: the observable quotient of the 10-state filter, innovation for innovation, whatever the attitude."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.policies.quotient import refuse_inexact
from estimfw.run.answer import answer
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]
Pair = Callable[..., tuple[Any, Any]]

CONSTANT_FORCE, IN_N, FLAT = (
    "sins_static.constant_specific_force", "sins_static.bias_in_navigation_frame", "sins_static.remove_vertical_channel",
)  # fmt: skip
QUOTIENT = "{kind: sins_static.prune_unobservable, mode: quotient}"


def policies(*names: str) -> str:
    return f"policies=[{', '.join(names)}]"


@pytest.fixture(scope="module")
def pair(composed: Callable[..., Any]) -> Pair:
    """The 10-state problem with n-frame biases and its quotient, with or without Coriolis in both."""

    def make(coriolis: bool, *overrides: str) -> tuple[Any, Any]:
        before = (*(() if coriolis else ("sins_static.remove_coriolis",)), CONSTANT_FORCE, IN_N, FLAT)
        ten = composed("static_12", policies(*before), *overrides)
        seven = composed("static_12", policies(*before, QUOTIENT), *overrides)
        assert (len(ten.plan.states), len(seven.plan.states)) == (10, 7)
        return ten, seven

    return make


def attitude(yaw: float, pitch: float, roll: float) -> list[str]:
    return [f"initial_attitude.{n}={a} deg" for n, a in zip(("yaw", "pitch", "roll"), (yaw, pitch, roll), strict=True)]


def tenths(first: int, last: int) -> st.SearchStrategy[float]:
    """Angles in deg, no finer than a config writes them."""
    return st.integers(10 * first, 10 * last).map(lambda x: x / 10.0)


@settings(max_examples=10, deadline=None)
@given(
    latitude=st.one_of(tenths(-85, -1), tenths(1, 85)),
    angles=st.tuples(tenths(-180, 180), tenths(-80, 80), tenths(-180, 180)),
    coriolis=st.booleans(),
)
def test_dynamics_and_measurement_commute_with_the_map_of_the_specification(
    latitude: float, angles: tuple[float, float, float], coriolis: bool, pair: Pair, quotient: Callable[..., FloatArray]
) -> None:
    ten, seven = pair(coriolis, f"site.latitude={latitude} deg", *attitude(*angles))
    T = seven.model.quotient.T
    known = quotient(ten.plan.states, seven.plan.states, ten.reference)
    np.testing.assert_allclose(T, known, rtol=1e-8, atol=0.0)

    def matrices(problem: Any) -> tuple[FloatArray, FloatArray]:
        F = problem.model.F.coefficient.evaluate(problem.reference)
        return F, problem.model.H("zero_velocity").coefficient.evaluate(problem.reference)

    (F_10, H_10), (F_7, H_7) = matrices(ten), matrices(seven)
    size = np.abs(T) @ np.abs(F_10) + np.abs(F_7) @ np.abs(T)
    assert np.all(np.abs(T @ F_10 - F_7 @ T) <= 1e-9 * size)
    np.testing.assert_array_equal(H_10, H_7 @ T)
    P_10, P_7 = (p.plan.prior.evaluate(p.reference)[1] for p in (ten, seven))
    np.testing.assert_allclose(P_7, known @ P_10 @ known.T, rtol=1e-9, atol=0.0)


@pytest.mark.parametrize(
    ("tilt", "coriolis", "angles"),
    [
        (1.0, False, (-170.0, -60.0, 90.0)), (1.0, True, (0.0, 0.0, 0.0)), (5.0, True, (40.0, 20.0, -30.0)),
        (10.0, False, (123.0, 7.0, -45.0)), (10.0, True, (-80.0, 55.0, 150.0)),
    ],
)  # fmt: skip
def test_the_quotient_gives_the_innovations_and_the_combined_attitude_of_the_whole_filter(
    tilt: float, coriolis: bool, angles: tuple[float, float, float], pair: Pair, misaligned: Callable[..., str],
    quotient: Callable[..., FloatArray],
) -> None:  # fmt: skip
    problems = pair(coriolis, misaligned(tilt), *attitude(*angles), "estimator.kernel=numba")
    ten, seven = (run_problem(p) for p in problems)
    T = quotient(problems[0].plan.states, problems[1].plan.states, problems[0].reference)
    assert ten.estimate.shape[0] == 600
    assert np.max(np.abs(seven.innovation - ten.innovation) / ten.innovation_sigma) < 1e-9
    assert np.max(np.abs(np.degrees(seven.estimate - ten.estimate @ T.T)[:, 2:5])) < 1e-9
    scale = np.sqrt(np.diag(T @ ten.covariance[-1] @ T.T))
    np.testing.assert_allclose(
        seven.covariance[-1] / np.outer(scale, scale), T @ ten.covariance[-1] @ T.T / np.outer(scale, scale), atol=1e-6
    )


def test_it_is_the_same_with_correlations_and_in_the_other_kernel(pair: Pair, misaligned: Callable[..., str]) -> None:
    entries = (
        "{between: ['attitude_error[E]', 'attitude_error[N]'], value: 0.4}",
        "{between: ['attitude_error[U]', 'velocity_error[E]'], value: -0.3}",
    )
    own = (misaligned(10.0, -5.0, 8.0), f"prior.correlations=[{', '.join(entries)}]", "estimator.kernel=numpy")
    ten, seven = (run_problem(p) for p in pair(True, *own))
    assert np.max(np.abs(seven.innovation - ten.innovation) / ten.innovation_sigma) < 1e-9


def test_its_truth_is_the_combination_of_the_truths(pair: Pair, quotient: Callable[..., FloatArray]) -> None:
    problems = pair(False, "source.duration=20 s")
    ten, seven = (run_problem(p) for p in problems)
    T = quotient(problems[0].plan.states, problems[1].plan.states, problems[0].reference)
    assert ten.truth is not None and seven.truth is not None
    np.testing.assert_allclose(seven.truth, ten.truth @ T.T, rtol=1e-10, atol=1e-15)


def test_in_closed_loop_it_corrects_the_nominal_by_what_it_stands_for(
    pair: Pair, misaligned: Callable[..., str]
) -> None:
    small = (misaligned(1e-3), "estimator.loop=closed", "source.duration=120 s")
    ten, seven = (run_problem(p) for p in pair(False, *small))
    assert np.max(np.abs(seven.innovation - ten.innovation) / ten.innovation_sigma) < 1e-6


def test_a_result_says_what_each_state_and_each_output_stands_for(pair: Pair) -> None:
    made = result_dataset(run_problem(pair(False, "source.duration=20 s")[1]))
    meanings = dict(zip(made["state"].to_numpy(), made["state_meaning"].to_numpy(), strict=True))
    assert meanings["velocity_error[E]"] == "velocity_error[E]"
    assert meanings["attitude_error[E]"].startswith("attitude_error[E] + 0.102 ")
    assert meanings["attitude_error[E]"].endswith(" * accel_bias[N]")
    assert "1.65e+04 s * gyro_bias[E]" in meanings["attitude_error[U]"]
    told = answer(made)
    assert told["states"]["attitude_error[N]"]["meaning"] == meanings["attitude_error[N]"]
    assert "meaning" not in told["states"]["velocity_error[E]"]
    assert meanings["attitude_error[E]"] in told["attitude"]["yaw"]["meaning"]


def test_it_is_refused_where_the_plan_varies_saying_why(composed: Callable[..., Any]) -> None:
    with pytest.raises(ConfigError, match=r"time-invariant plan only.* needs C_bn, which is varying"):
        composed("static_12", policies(CONSTANT_FORCE, FLAT, QUOTIENT))


def test_at_a_start_with_other_constants_it_is_refused(pair: Pair) -> None:
    _, seven = pair(True)
    turned = {**seven.reference, "C_bn": np.eye(3)[[1, 2, 0]]}
    refuse_inexact(seven.model, turned)
    with pytest.raises(ConfigError, match="not exact at this nominal, T F = F_r T does not hold"):
        refuse_inexact(seven.model, {**seven.reference, "gravity": np.array(9.79)})


def test_it_is_refused_before_other_policies(composed: Callable[..., Any]) -> None:
    with pytest.raises(ConfigError, match="exact quotient") as caught:
        composed("static_12", policies(CONSTANT_FORCE, IN_N, QUOTIENT, FLAT))
    assert "before prune_unobservable" in str(caught.value.hint)


def test_prior_correlations_of_a_config_reach_the_filter(composed: Callable[..., Any]) -> None:
    entry = "{between: ['attitude_error[E]', 'attitude_error[N]'], value: 0.4}"
    problem = composed("static_7", f"prior.correlations=[{entry}]")
    _, covariance = problem.plan.prior.evaluate(problem.reference)
    first = problem.plan.states.index("attitude_error[E]")
    assert covariance[first, first + 1] == pytest.approx(0.4 * np.radians(10.0) ** 2)
