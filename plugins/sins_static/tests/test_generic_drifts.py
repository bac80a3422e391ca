"""Gauss-Markov drifts in place of the plugin's constant biases, by config alone: a generic block in the body frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.run.run import Collected

FloatArray = NDArray[np.float64]
Compose = Callable[..., Problem]

TILTED = ("initial_attitude.yaw=130 deg", "initial_attitude.pitch=20 deg", "initial_attitude.roll=-35 deg")
GYRO, ACCEL, PHI = slice(9, 12), slice(6, 9), slice(3, 6)
TAU = 300.0


def drift(block: str, unit: str, sigma: str, tau: str = "300 s", more: str = "frame: b") -> str:
    name = "b_g" if block == "gyro_bias" else "b_a"
    settings = f"unit: {unit}, sigma: {sigma}, steady_sigma: {sigma}, correlation_time: {tau}, latex: {name}"
    return f"blocks.{block}={{kind: gauss_markov, {settings}, {more}}}"


def gyro_drift(more: str = "frame: b, quantity: gyro_bias, truth: gyro_bias_b", tau: str = "300 s") -> str:
    return drift("gyro_bias", "rad/s", "0.01 deg/h", tau, more)


ACCEL_DRIFT = drift("accel_bias", "m/s^2", "100 ug")


def F_of(problem: Problem) -> FloatArray:
    return problem.model.F.coefficient.evaluate(problem.reference)


@pytest.mark.parametrize("axes", ["", ", axes: [R, F, U]"])
def test_a_drift_in_b_enters_the_attitude_through_the_rotation(composed: Compose, axes: str) -> None:
    problem = composed("static_12", "policies=[]", gyro_drift(f"frame: b{axes}"), *TILTED)
    F, R = F_of(problem), problem.reference["C_bn"]
    assert np.abs(R - np.eye(3)).max() > 0.5
    np.testing.assert_array_equal(F[PHI, GYRO], -R)
    np.testing.assert_allclose(F[GYRO, GYRO], -np.eye(3) / TAU, rtol=1e-15)
    assert problem.model.states[9:] == ("gyro_bias[R]", "gyro_bias[F]", "gyro_bias[U]")


def test_its_model_is_that_of_the_constant_but_for_the_decay_and_the_noise(composed: Compose) -> None:
    constant = composed("static_12", *TILTED)
    markov = composed("static_12", gyro_drift(), *TILTED)
    decay = np.zeros((12, 12))
    decay[GYRO, GYRO] = -np.eye(3) / TAU
    np.testing.assert_allclose(F_of(markov), F_of(constant) + decay, rtol=0, atol=1e-18)
    power = np.zeros((12, 12))
    power[GYRO, GYRO] = 2.0 * (0.01 * np.pi / 180.0 / 3600.0) ** 2 / TAU * np.eye(3)
    more = markov.model.diffusion.evaluate({}) - constant.model.diffusion.evaluate({})
    np.testing.assert_allclose(more, power, rtol=1e-14, atol=1e-40)


def test_in_n_it_loses_the_rotation_and_gets_the_turn_of_the_frame(composed: Compose) -> None:
    policies = "policies=[{kind: express_in_frame, block: gyro_bias, frame: n}]"
    problem = composed("static_12", policies, gyro_drift(tau="[100 s, 200 s, 400 s]"), *TILTED)
    assert "gyro_bias.frame_rotation" in [t.label for t in problem.model.terms]
    R, rate = problem.reference["C_bn"], np.array([0.1, -0.2, 0.3])
    F = problem.model.F.coefficient.evaluate({**problem.reference, "omega_nb_n": rate})
    np.testing.assert_array_equal(F[PHI, GYRO], -np.eye(3))
    turning = np.array([[0.0, -0.3, -0.2], [0.3, 0.0, -0.1], [0.2, 0.1, 0.0]])
    decay = R @ np.diag([-1 / 100.0, -1 / 200.0, -1 / 400.0]) @ R.T
    np.testing.assert_allclose(F[GYRO, GYRO], turning + decay, atol=1e-16)


def test_the_named_policies_reduce_it_as_they_do_the_constant(composed: Compose) -> None:
    drifting = composed("static_7", gyro_drift(), ACCEL_DRIFT, *TILTED)
    constant = composed("static_7", *TILTED)
    assert drifting.plan.time_invariant
    assert drifting.model.states[:5] == constant.model.states[:5]
    in_n = "policies=[sins_static.constant_specific_force, sins_static.bias_in_navigation_frame]"
    problem = composed("static_12", in_n, gyro_drift(), ACCEL_DRIFT, *TILTED)
    assert problem.plan.time_invariant
    F = F_of(problem)
    np.testing.assert_array_equal(F[PHI, GYRO], -np.eye(3))
    np.testing.assert_array_equal(F[0:3, ACCEL], np.eye(3))
    np.testing.assert_allclose(F[GYRO, GYRO], -np.eye(3) / TAU, rtol=1e-15)


def test_its_truth_is_the_one_it_names(composed: Compose, ran: Callable[..., Collected]) -> None:
    settings = ("source.duration=20 s", "source.noise=false")
    done = ran("static_12", gyro_drift(), *settings, *TILTED)
    own = ran("static_12", *settings, *TILTED)
    assert done.truth is not None
    assert own.truth is not None
    np.testing.assert_array_equal(done.truth[:, GYRO], own.truth[:, GYRO])
    assert np.isfinite(done.truth[:, GYRO]).all()


def test_a_triad_without_a_frame_meets_no_term_that_has_one(composed: Compose) -> None:
    with pytest.raises(
        ConfigError, match=r"gyro_bias' has no frame, but term 'gyro_bias_coupling' acts in frame 'n'"
    ) as e:
        composed("static_12", gyro_drift("axes: [R, F, U]"))
    assert e.value.hint == "give the block its frame: `frame: b`"
    assert "blocks.gyro_bias" in str(e.value)
    with pytest.raises(ConfigError, match=r"give the block its frame: `frame: n` or `frame: b`"):
        composed("static_12", gyro_drift("axes: [x, y, z]"))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("frame: bb", r"blocks\.gyro_bias\.frame: there is no frame 'bb'[\s\S]*did you mean 'b'\?"),
        ("frame: n, axes: [R, F, U]", r"gyro_bias\.axes: R, F, U are not the axes of frame 'n', which are E, N, U"),
        ("frame: b, axes: [R, F]", r"gyro_bias\.axes: 2 axes in the frame 'b'[\s\S]*leave out `axes`"),
    ],
)
def test_a_frame_that_does_not_fit_is_refused_where_it_stands(composed: Compose, more: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        composed("static_12", gyro_drift(more))
