"""A tracker and a heated thermal model, from configs without a plugin, against filters typed in here by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from estimfw.config.compose import Problem
from estimfw.run.load import load_record
from estimfw.run.run import Collected, run_problem

FloatArray = NDArray[np.float64]
Example = Callable[..., Problem]


def update(
    x: FloatArray, P: FloatArray, z: FloatArray, H: FloatArray, R: FloatArray, limit: float = np.inf
) -> tuple[FloatArray, FloatArray, float]:
    """All components at once, by the inverse of S; nothing happens beyond the limit of the NIS."""
    S = H @ P @ H.T + R
    nu = z - H @ x
    nis = float(nu @ np.linalg.inv(S) @ nu)
    if nis > limit:
        return x, P, nis
    K = P @ H.T @ np.linalg.inv(S)
    return x + K @ nu, (np.eye(x.size) - K @ H) @ P, nis


def assert_same(run: Collected, states: FloatArray, sigmas: FloatArray) -> None:
    assert np.max(np.abs(run.estimate - states) / sigmas) < 1e-8
    np.testing.assert_allclose(run.sigma, sigmas, rtol=1e-8)


@pytest.mark.parametrize("seed", [7, 8])
def test_tracker(example: Example, seed: int) -> None:
    # Two axes with position and velocity; fixes of both positions at 2 Hz, of the speed in x at 5 Hz; gate at 99.9 %.
    problem = example("tracker", f"source.seed={seed}")
    record = load_record(problem)
    fix, speed = record.streams["fix"], record.streams["speed"]
    x, P = np.zeros(4), np.diag([50.0**2, 50.0**2, 25.0, 25.0])
    now, states, sigmas, gated = 0.0, [], [], 0
    for t in np.unique(np.round(np.concatenate([fix.time, speed.time]), 9)):
        dt = t - now
        now = float(t)
        Phi, q = np.eye(4), 0.3**2
        Phi[0, 2] = Phi[1, 3] = dt
        Q = np.zeros((4, 4))
        for axis in (0, 1):
            Q[axis, axis], Q[axis + 2, axis + 2] = q * dt**3 / 3, q * dt
            Q[axis, axis + 2] = Q[axis + 2, axis] = q * dt**2 / 2
        x, P = Phi @ x, Phi @ P @ Phi.T + Q
        if (at := np.flatnonzero(np.abs(fix.time - t) < 1e-6)).size:
            H = np.eye(4)[:2]
            x, P, nis = update(x, P, fix.values[at[0]], H, 9.0 * np.eye(2), limit=13.815510557964274)
            gated += nis > 13.815510557964274
        if (at := np.flatnonzero(np.abs(speed.time - t) < 1e-6)).size:
            H = np.eye(4)[2:3]
            x, P, nis = update(x, P, speed.values[at[0]], H, np.array([[0.04]]), limit=10.827566170662733)
            gated += nis > 10.827566170662733
        states.append(x)
        sigmas.append(np.sqrt(np.diag(P)))
    run = run_problem(problem, record=record)
    assert_same(run, np.array(states), np.array(sigmas))
    assert np.count_nonzero(run.disposition == 1) == gated


def test_heated_thermal_model(example: Example) -> None:
    # Phi by expm; Q and the effect of the heater by integrating their differential equations.
    problem = example("thermal", "source.duration=2000 s")
    record = load_record(problem)
    sensor = record.streams["case_sensor"]
    F = np.array([[-1 / 300, 1 / 300], [1 / 900, -1 / 900 - 1 / 1800]])
    D, H, R = np.diag([0.005**2, 0.01**2]), np.array([[0.0, 1.0]]), np.array([[0.04]])

    def rate(_: float, y: FloatArray) -> FloatArray:
        Q = y[:4].reshape(2, 2)
        return np.concatenate([(F @ Q + Q @ F.T + D).ravel(), F @ y[4:] + [0.02, 0.0]])

    made = solve_ivp(rate, (0.0, 5.0), np.zeros(6), rtol=1e-12, atol=1e-18).y[:, -1]
    Phi, Q, response = expm(F * 5.0), made[:4].reshape(2, 2), made[4:]
    x, P, states, sigmas = np.zeros(2), np.diag([4.0, 4.0]), [], []
    for t, z in zip(sensor.time, sensor.values, strict=True):
        power = 0.0 if t <= 300.0 else 5.0 if t <= 1500.0 else 2.0
        x, P = Phi @ x + response * power, Phi @ P @ Phi.T + Q
        x, P, _ = update(x, P, z, H, R)
        states.append(x)
        sigmas.append(np.sqrt(np.diag(P)))
    run = run_problem(problem, record=record)
    assert_same(run, np.array(states), np.array(sigmas))
    assert np.max(run.estimate[:, 0]) > 20.0


@pytest.mark.parametrize("name", ["tracker", "thermal"])
def test_what_the_model_simulates_its_filter_estimates_honestly(example: Example, name: str) -> None:
    # NEES from the very first epoch on: the prior holds where the simulated record says that it starts.
    duration = "20 s" if name == "tracker" else "300 s"
    nees = []
    for seed in range(60):
        run = run_problem(
            example(name, f"source.seed={seed}", f"source.duration={duration}", "estimator={kind: kalman}")
        )
        assert run.truth is not None and run.prepared.steps.start == 0.0
        error = run.estimate[run.covariance_index] - run.truth[run.covariance_index]
        nees.append(
            [e @ np.linalg.solve(P, e) for e, P in zip(error, run.covariance, strict=True)][:: max(1, len(error) // 4)]
        )
    mean, n = np.mean(nees, axis=0), run.estimate.shape[1]
    assert np.all(np.abs(mean - n) < 3.5 * np.sqrt(2 * n / 60))
