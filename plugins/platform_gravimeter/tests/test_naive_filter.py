"""Estimates and sigmas against a filter written out in NumPy: predict, then update, matrices from SciPy's exponential."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from estimfw.config.compose import Problem
from estimfw.run.load import load_record
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]

RATE, R, G, L = 7.292115e-5, 6371000.0, 9.80665, np.radians(39.1)
UG, DEGREE = 9.80665e-6, np.pi / 180.0


def matrices(alpha: float) -> tuple[FloatArray, FloatArray]:
    """Phi and Q of a second, by Van Loan."""
    up, north, c, s = RATE * np.sin(L), RATE * np.cos(L), np.cos(alpha), np.sin(alpha)
    F = np.zeros((10, 10))
    F[0] = [0.0, 2.0 * up, 0.0, -G, 0.0, c, -s, 0.0, 0.0, 0.0]
    F[1] = [-2.0 * up, 0.0, G, 0.0, 0.0, s, c, 0.0, 0.0, 0.0]
    F[2] = [0.0, -1.0 / R, 0.0, up, -north, 0.0, 0.0, c, -s, 0.0]
    F[3] = [1.0 / R, 0.0, -up, 0.0, 0.0, 0.0, 0.0, s, c, 0.0]
    F[4] = [np.tan(L) / R, 0.0, north, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    D = np.diag([*[(5.0 * UG) ** 2] * 2, *[(0.001 * DEGREE / 60.0) ** 2] * 3, *[0.0] * 5])
    big = expm(np.block([[-F, D], [np.zeros((10, 10)), F.T]]))
    Phi = big[10:, 10:].T
    return Phi, Phi @ big[:10, 10:]


def filtered(readings: FloatArray, alphas: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Estimates and sigmas (K, 10); step k is at alphas[k]."""
    x = np.zeros(10)
    sigma = [0.1, 0.1, 0.1 * DEGREE, 0.1 * DEGREE, DEGREE, 50 * UG, 50 * UG, *[0.02 * DEGREE / 3600.0] * 3]
    P, H, noise = np.diag(np.square(sigma)), np.eye(2, 10), 1e-4 * np.eye(2)
    known = {alpha: matrices(alpha) for alpha in set(alphas.tolist())}
    estimates, sigmas = [], []
    for z, alpha in zip(readings, alphas.tolist(), strict=True):
        Phi, Q = known[alpha]
        x, P = Phi @ x, Phi @ P @ Phi.T + Q
        K = np.linalg.solve(H @ P @ H.T + noise, H @ P).T
        x, left = x + K @ (z - H @ x), np.eye(10) - K @ H
        P = left @ P @ left.T + K @ noise @ K.T
        estimates.append(x)
        sigmas.append(np.sqrt(np.diag(P)))
    return np.array(estimates), np.array(sigmas)


@pytest.mark.parametrize(("second", "kernel"), [(30.0, "numba"), (120.0, "numba"), (120.0, "numpy")])
def test_estimates_and_sigmas_are_those_of_a_filter_written_out(opened: Open, second: float, kernel: str) -> None:
    """One position, and two; 1e-6 of a sigma, and relative."""
    positions = f"nominal.positions=[{{alpha: 30 deg}}, {{time: 600 s, alpha: {second} deg}}]"
    problem = opened("gravimeter_two_positions", positions, f"estimator.kernel={kernel}")
    record = load_record(problem)
    alphas = np.radians(np.where(np.arange(1200) < 600, 30.0, second))
    x, sigma = filtered(record.streams["velocity"].values, alphas)
    done = run_problem(problem, record=record)
    np.testing.assert_allclose(done.sigma, sigma, rtol=1e-6)
    assert np.max(np.abs(done.estimate - x) / sigma) < 1e-6


@pytest.mark.parametrize("alpha", [0.0, 30.0])
def test_sigmas_of_one_position_are_those_of_a_filter_written_out(opened: Open, alpha: float) -> None:
    done = run_problem(opened("gravimeter", f"nominal.alpha={alpha} deg"))
    _, sigma = filtered(np.zeros((1200, 2)), np.full(1200, np.radians(alpha)))
    for second in (60, 300, 600, 1200):
        np.testing.assert_allclose(done.sigma[second - 1], sigma[second - 1], rtol=1e-6, err_msg=f"{second} s")


@pytest.mark.parametrize("alpha", [0.0, 30.0])
def test_phi_and_q_are_those_of_van_loan(opened: Open, alpha: float) -> None:
    """1e-10 of each entry, or of what the sigmas of its row and column make of it."""
    plan = opened("gravimeter", f"nominal.alpha={alpha} deg").plan
    row = plan.layout.complete(plan.layout.pack(opened("gravimeter", f"nominal.alpha={alpha} deg").reference))
    Phi, Q, _ = plan.discretised(row, np.zeros(0), np.array(1.0), 0)
    due_Phi, due_Q = matrices(np.radians(alpha))
    np.testing.assert_allclose(Phi, due_Phi, rtol=1e-10, atol=1e-15)
    spread = np.sqrt(np.outer(np.diag(due_Q), np.diag(due_Q)))
    assert np.max(np.abs(Q - due_Q)[:5, :5] / spread[:5, :5]) < 1e-10
    assert not Q[5:].any() and not Q[:, 5:].any()
