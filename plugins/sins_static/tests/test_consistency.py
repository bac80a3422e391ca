"""NEES and NIS over runs drawn from the prior: the 12- and 10-state filters are as good as they say.

Each run draws the biases, the misalignment and the start velocity from P0, the sensors' noises, and 0.1 m/s of velocity
noise at each epoch. The attitude's P0 is small here (0.01 deg level, 0.1 deg heading), so that the second-order term
of the linearisation stays below its sigma.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.model.coefficient import identity
from estimfw.model.prior import Prior
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]

UG, DEG_H = 9.80665e-6, np.radians(1.0 / 3600.0)
BEFORE = (
    "sins_static.constant_specific_force",
    "sins_static.remove_coriolis",
    "sins_static.bias_in_navigation_frame",
    "sins_static.remove_vertical_channel",
)
SIGMA_PHI = np.radians([0.01, 0.01, 0.1])
SETTINGS = (
    "blocks.attitude_error.sigma=[0.01 deg, 0.01 deg, 0.1 deg]",
    "source.velocity_noise=0.1 m/s",
    "measurements.zero_velocity.reference=velocity_reference",
    "estimator.kernel=numba",
)


def drawn_run(problem: Any, seed: int) -> tuple[Any, dict[str, FloatArray]]:
    """A run from a start drawn from the prior, and its true biases."""
    rng = np.random.default_rng([2024, seed])
    phi = SIGMA_PHI * rng.standard_normal(3)
    velocity = 0.1 * rng.standard_normal(3)
    bias = {"accel_bias": 100.0 * UG * rng.standard_normal(3), "gyro_bias": 0.01 * DEG_H * rng.standard_normal(3)}
    chosen = {name: tuple(float(x) for x in value) for name, value in bias.items()}
    cfg = problem.source.cfg.model_copy(update={"seed": seed, **chosen})
    record = replace(problem.source, cfg=cfg).load()
    start = {
        "C_bn": Rotation.from_rotvec(-phi).as_matrix() @ problem.source.C_bn,
        "velocity_n": velocity,
    }
    return run_problem(replace(problem, initial=None), record=replace(record, initial=start)), bias


def consistency(problem: Any, runs: int) -> tuple[float, float]:
    """Mean NEES at the end and mean NIS over all epochs."""
    nees, nis = [], []
    for seed in range(1, runs + 1):
        done, _ = drawn_run(problem, seed)
        nees.append(squared(done.estimate[-1] - done.truth[-1], done.covariance[-1]))
        nis.append(np.mean(done.nis))
    return float(np.mean(nees)), float(np.mean(nis))


def squared(error: FloatArray, covariance: FloatArray) -> float:
    return float(error @ np.linalg.solve(covariance, error))


def assert_consistent(problem: Any, runs: int, rows: int) -> None:
    states = len(problem.plan.states)
    nees, nis = consistency(problem, runs)
    assert abs(nees - states) < 3.3 * np.sqrt(2.0 * states / runs), nees
    assert abs(nis - rows) < 0.03, nis


@pytest.mark.parametrize(("example", "rows"), [("static_12", 3), ("static_10", 2)])
def test_nees_and_nis_are_their_degrees_of_freedom(example: str, rows: int, composed: Callable[..., Any]) -> None:
    assert_consistent(composed(example, *SETTINGS), 100, rows)


@pytest.mark.slow
@pytest.mark.parametrize(("example", "rows"), [("static_12", 3), ("static_10", 2)])
def test_nees_and_nis_of_400_runs(example: str, rows: int, composed: Callable[..., Any]) -> None:
    assert_consistent(composed(example, *SETTINGS), 400, rows)


def test_a_truly_still_base_shows_that_the_measurement_noise_is_too_large(ran: Callable[..., Any]) -> None:
    # R = (0.1 m/s)^2 is 30 times the noise of a base that does not move at all: NIS 0.002.
    done = ran("static_7", "estimator.kernel=numba")
    assert np.mean(done.nis[100:]) < 0.01


def test_seven_states_are_consistent_with_the_combinations_and_not_with_the_attitude_itself(
    composed: Callable[..., Any], quotient: Callable[..., FloatArray]
) -> None:
    ten = composed("static_12", f"policies=[{', '.join(BEFORE)}]", *SETTINGS)
    seven = composed("static_7", *SETTINGS)
    T = quotient(ten.plan.states, seven.plan.states, ten.reference)
    _, P = ten.plan.prior.evaluate(ten.reference)
    rows = tuple(tuple(float(x) for x in row) for row in T @ P @ T.T)
    whole = replace(seven, plan=replace(seven.plan, prior=Prior((0.0,) * 7, rows, identity(7))))
    of_combinations, of_attitude, runs = [], [], 100
    for seed in range(1, runs + 1):
        done, bias = drawn_run(whole, seed)
        truth = dict(zip(done.prepared.plan.states, done.truth[-1], strict=True))
        for axis, a, e in zip("ENU", bias["accel_bias"], bias["gyro_bias"], strict=True):
            truth |= {f"accel_bias[{axis}]": a, f"gyro_bias[{axis}]": e}
        combined = T @ np.array([truth[label] for label in ten.plan.states])
        of_combinations.append(squared(done.estimate[-1] - combined, done.covariance[-1]))
        phi = slice(2, 5)
        of_attitude.append(squared((done.estimate[-1] - done.truth[-1])[phi], done.covariance[-1][phi, phi]))
    assert abs(np.mean(of_combinations) - 7.0) < 3.3 * np.sqrt(14.0 / runs)
    assert np.mean(of_attitude) > 30.0
