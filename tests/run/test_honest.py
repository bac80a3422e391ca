"""Honest sigmas against the joint moments of truth and estimate, written down by hand for two reduced models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from estimfw.analysis import dual_covariance
from estimfw.config.compose import Problem
from estimfw.errors import NumericalError
from estimfw.run import run as runner
from estimfw.run.budget import error_budget
from estimfw.run.dataset import result_dataset
from estimfw.run.load import load_record
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]
Composed = Callable[[str], Problem]

TRACKER = """\
estimfw: 1
blocks:
  position: {kind: random_constant, unit: m, sigma: 50 m}
  velocity: {kind: random_walk, unit: m/s, sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)}
  drift: {kind: gauss_markov, unit: m, sigma: 4 m, steady_sigma: 4 m, correlation_time: 30 s}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}, {block: drift}], noise: 3 m}
estimator: {kind: kalman, restarts: [%s]}
policies: [{kind: drop_states, states: [drift]}]
source: {kind: simulate_model, duration: 60 s, rate: 1 Hz, seed: 7}
"""
HEATER = """\
estimfw: 1
inputs:
  heater: {kind: schedule, unit: W, steps: [{time: 0 s, value: 2 W}, {time: 40 s, value: 5 W}]}
blocks:
  core: {kind: random_walk, unit: K, sigma: 2 K, mean: 1 K, noise: 0.05 K/sqrt(s)}
  case: {kind: random_walk, unit: K, sigma: 1 K, noise: 0.1 K/sqrt(s)}
process:
  core_loss: {kind: couple, target: core, source: core, coefficient: -0.01}
  case_gain: {kind: couple, target: case, source: core, coefficient: 0.02}
  heating: {kind: couple, target: core, source: heater, coefficient: 0.02}
measurements:
  sensor: {kind: direct, of: [{block: case}], noise: 0.2 K}
estimator: {kind: kalman}
policies: [{kind: drop_term, terms: [heating]}]
source: {kind: simulate_model, duration: 60 s, rate: 1 Hz, seed: 3}
"""


@dataclass
class Linear:
    """x' = F x + b + w with white w of diffusion D, read by H with noise R, begun at mean and P."""

    F: FloatArray
    D: FloatArray
    H: FloatArray
    mean: FloatArray
    P: FloatArray

    def step(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Phi, Q and the integral of Phi over one second."""
        n = len(self.F)
        fine = [expm(self.F * s) for s in np.linspace(0.0, 1.0, 2001)]
        weight = np.full(2001, 1.0 / 2000.0)
        weight[[0, -1]] *= 0.5
        Q = sum(w * A @ self.D @ A.T for w, A in zip(weight, fine, strict=True))
        return fine[-1], Q, sum((w * A for w, A in zip(weight, fine, strict=True)), np.zeros((n, n)))


def joint_moments(
    truth: Linear,
    own: Linear,
    M: FloatArray,
    R: float,
    drive: Callable[[int], tuple[FloatArray, FloatArray]],
    restarts: tuple[int, ...] = (),
) -> FloatArray:
    """Roots of the mean squares of M x - x_hat after each of 60 updates, in the coordinates [x; x_hat] of a textbook."""
    a, n = len(truth.F), len(own.F)
    (Phi_t, Q_t, I_t), (Phi_f, Q_f, I_f) = truth.step(), own.step()
    mean = np.concatenate([truth.mean, own.mean])
    P = np.zeros((a + n, a + n))
    P[:a, :a] = truth.P
    P_own, found = own.P, []
    for k in range(60):
        if k in restarts:
            mean[a:], P[a:, :], P[:, a:], P_own = own.mean, 0.0, 0.0, own.P
        b_t, b_f = drive(k)
        P_own = Phi_f @ P_own @ Phi_f.T + Q_f
        K = P_own @ own.H.T / (own.H @ P_own @ own.H.T + R)
        P_own = (np.eye(n) - K @ own.H) @ P_own
        A = np.block([[Phi_t, np.zeros((a, n))], [K @ truth.H @ Phi_t, (np.eye(n) - K @ own.H) @ Phi_f]])
        G = np.vstack([np.eye(a), K @ truth.H])
        d_t, d_f = I_t @ b_t, I_f @ b_f
        mean = A @ mean + np.concatenate([d_t, K @ truth.H @ d_t + (np.eye(n) - K @ own.H) @ d_f])
        P = A @ P @ A.T + G @ Q_t @ G.T
        P[a:, a:] += K @ K.T * R
        error = np.hstack([M, -np.eye(n)])
        found.append(np.sqrt(np.diag(error @ (P + np.outer(mean, mean)) @ error.T)))
    return np.array(found)


@pytest.mark.parametrize("restarts", [(), (20, 41)])
def test_a_dropped_drift_of_a_sensor_lives_on_in_the_honest_sigma(
    composed: Composed, restarts: tuple[int, ...]
) -> None:
    done = run_problem(composed(TRACKER % ", ".join(f"{t} s" for t in restarts)))
    velocity = 0.09 * np.array([[0.0, 0.0], [0.0, 1.0]])
    F = np.array([[0.0, 1.0], [0.0, 0.0]])
    own = Linear(F, velocity, np.array([[1.0, 0.0]]), np.zeros(2), np.diag([2500.0, 25.0]))
    big = np.zeros((3, 3))
    big[:2, :2], big[2, 2] = F, -1.0 / 30.0
    D = np.zeros((3, 3))
    D[:2, :2], D[2, 2] = velocity, 2.0 * 16.0 / 30.0
    truth = Linear(big, D, np.array([[1.0, 0.0, 1.0]]), np.zeros(3), np.diag([2500.0, 25.0, 16.0]))
    nothing = (np.zeros(3), np.zeros(2))
    expected = joint_moments(truth, own, np.eye(2, 3), 9.0, lambda k: nothing, restarts)
    assert done.honest is not None
    np.testing.assert_allclose(done.honest.sigma, expected, rtol=1e-6)
    assert done.honest.sigma[-1, 0] > 2.0 * done.sigma[-1, 0]
    np.testing.assert_allclose(done.honest.covariance[-1].diagonal(), expected[-1] ** 2, rtol=2e-6)


def test_a_dropped_known_input_is_an_error_that_the_honest_sigma_has(composed: Composed) -> None:
    """It is known, so it is no variance; the honest sigma is the root of the whole mean square."""
    done = run_problem(composed(HEATER))
    F, D, H = np.array([[-0.01, 0.0], [0.02, 0.0]]), np.diag([0.0025, 0.01]), np.array([[0.0, 1.0]])
    both = Linear(F, D, H, np.array([1.0, 0.0]), np.diag([4.0, 1.0]))

    def drive(k: int) -> tuple[FloatArray, FloatArray]:
        return np.array([0.02 * (2.0 if k < 40 else 5.0), 0.0]), np.zeros(2)

    expected = joint_moments(both, both, np.eye(2), 0.04, drive)
    assert done.honest is not None
    np.testing.assert_allclose(done.honest.sigma, expected, rtol=1e-6)
    assert done.honest.sigma[-1, 0] > 1.5 * done.sigma[-1, 0]


def test_a_model_that_is_not_reduced_has_no_honest_sigma_beside_its_own(composed: Composed) -> None:
    whole = TRACKER.replace("policies: [{kind: drop_states, states: [drift]}]", "") % ""
    dataset = result_dataset(run_problem(composed(whole)))
    assert "honest_sigma" not in dataset and "truth_model" not in dataset.attrs


def test_where_nothing_is_lost_the_honest_sigma_is_the_filters_own(composed: Composed) -> None:
    """A state that nothing reads and that drives nothing."""
    idle = TRACKER.replace("{block: position}, {block: drift}", "{block: position}") % ""
    done = run_problem(composed(idle))
    assert done.honest is not None
    np.testing.assert_allclose(done.honest.sigma, done.sigma, rtol=1e-10)


@pytest.mark.parametrize("longest", [1, 7])
def test_honest_sigmas_do_not_depend_on_chunks_and_batches(
    composed: Composed, monkeypatch: pytest.MonkeyPatch, longest: int
) -> None:
    problem = composed(TRACKER % "20 s")
    whole = run_problem(problem).honest
    monkeypatch.setattr(runner, "LONGEST_CHUNK", longest)
    monkeypatch.setattr(dual_covariance, "BATCH", 100)
    pieces = run_problem(problem).honest
    assert whole is not None and pieces is not None
    np.testing.assert_allclose(pieces.sigma, whole.sigma, rtol=1e-12)
    np.testing.assert_allclose(pieces.covariance, whole.covariance, rtol=1e-9)


@pytest.mark.parametrize(
    "drift",
    [
        "{kind: gauss_markov, unit: m, sigma: 4 m, steady_sigma: 4 m, correlation_time: 1e-12 s}",
        "{kind: random_constant, unit: m, sigma: 4 m}",
    ],
    ids=["stiff", "growing"],
)
def test_a_dropped_state_that_leaves_the_numbers_leaves_the_filter_alone(composed: Composed, drift: str) -> None:
    text = (TRACKER % "").replace(
        "{kind: gauss_markov, unit: m, sigma: 4 m, steady_sigma: 4 m, correlation_time: 30 s}", drift
    )
    grows = "  growth: {kind: couple, target: drift, source: drift, coefficient: 30}\nmeasurements:"
    text = text.replace("measurements:", grows) if "random" in drift else text
    record = load_record(composed(TRACKER % ""))
    done = run_problem(composed(text), record=record)
    assert done.honest is None and np.all(np.isfinite(done.estimate))
    assert any(e.kind == "no honest sigma" for e in done.events)
    with pytest.raises(NumericalError):
        error_budget(composed(text))
