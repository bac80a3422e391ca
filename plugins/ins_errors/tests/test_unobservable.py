"""What the measurements cannot tell apart: how many combinations, and which, in names."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.analysis.directions import StateNames, directions_of, undetectable_directions, unseen_rates
from estimfw.analysis.frozen import frozen_stretch
from estimfw.analysis.observability import Observability, frozen_observability
from estimfw.config.compose import Problem

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]
HEADING = "measurements.heading={kind: ins_errors.heading, noise: 6 arcmin}"
OMEGA, G = 7.292115e-5, 9.80665


def seen(problem: Problem) -> tuple[Observability, FloatArray]:
    frozen = frozen_stretch(problem.model, problem.reference)
    covariance = problem.model.prior.evaluate(problem.reference)[1]
    return frozen_observability(frozen.F, frozen.H, covariance), frozen.F


@pytest.mark.parametrize(
    ("example", "nullity"),
    [("ins_const11", 4), ("ins_const11_heading", 3), ("ins_gm9", 1), ("ins_gm9_heading", 0), ("ins_full14", 5)],
)
def test_nullities(opened: Open, example: str, nullity: int) -> None:
    found, _ = seen(opened(example))
    assert found.kernel.shape[1] == nullity
    assert found.spectrum.smallest_accepted > 1e3 * found.spectrum.largest_rejected


def test_nullity_of_14_states_with_heading(opened: Open) -> None:
    assert seen(opened("ins_full14", HEADING))[0].kernel.shape[1] == 3


def test_four_directions_of_constant_errors_in_free_alpha_beta_gamma_latitude(opened: Open) -> None:
    """Section 6: biases follow from free alpha, beta, gamma, dphi, the velocity errors are 0."""
    problem = opened("ins_const11")
    n = problem.plan.layout.unpack(problem.plan.layout.complete(problem.plan.layout.pack(problem.reference)))
    kernel = seen(problem)[0].kernel
    free = kernel[[0, 1, 2, 5]]
    alpha, beta, gamma, dphi = np.eye(4)
    assert np.linalg.matrix_rank(free * np.array([[1], [1], [1], [1e3]])) == 4
    solved = kernel @ np.linalg.inv(free)
    L, (Vx, Vy) = float(n["latitude"]), n["velocity_t"]
    R_M, R_N = 1 / n["meridian_curvature"], 1 / n["prime_vertical_curvature"]
    wy, wz = OMEGA * np.cos(L) + Vx / R_N, OMEGA * np.sin(L) + Vx * np.tan(L) / R_N
    k = 2 * OMEGA * np.cos(L) + Vx / np.cos(L) ** 2 / R_N
    due = {
        "velocity_error[E]": 0 * alpha,
        "velocity_error[N]": 0 * alpha,
        "gyro_bias[E]": wy * gamma - wz * beta,
        "gyro_bias[N]": wz * alpha + Vy / R_M * gamma + OMEGA * np.sin(L) * dphi,
        "gyro_bias[U]": -wy * alpha - Vy / R_M * beta - (OMEGA * np.cos(L) + Vx / np.cos(L) ** 2 / R_N) * dphi,
        "accel_bias[E]": G * beta - k * Vy * dphi,
        "accel_bias[N]": -G * alpha + k * Vx * dphi,
    }
    # In one prior sigma of each free error, against one prior sigma of the state: dphi is told in 1.6e-6 rad.
    sigma = np.sqrt(np.diag(problem.model.prior.evaluate(problem.reference)[1]))
    for label, row in due.items():
        i = problem.model.states.index(label)
        np.testing.assert_allclose(
            solved[i] * sigma[[0, 1, 2, 5]], row * sigma[[0, 1, 2, 5]], rtol=1e-6, atol=1e-9 * sigma[i]
        )


def test_the_four_directions_are_told_by_the_errors_of_the_ins(opened: Open) -> None:
    problem = opened("ins_const11")
    found, _ = seen(problem)
    covariance = problem.model.prior.evaluate(problem.reference)[1]
    driven = [not label.startswith(("gyro", "accel")) for label in problem.model.states]
    told = directions_of(found, covariance, StateNames.of(problem.model), driven)
    firsts = {d.terms[0].state for d in told}
    assert firsts == {"attitude_error[E]", "attitude_error[N]", "attitude_error[U]", "latitude_error"}
    by_first = {d.terms[0].state: {t.state for t in d.terms[1:]} for d in told}
    assert "gyro_bias[E]" in by_first["attitude_error[U]"]
    assert {"gyro_bias[N]", "gyro_bias[U]"} <= by_first["latitude_error"]
    assert "accel_bias[E]" in by_first["attitude_error[N]"]
    assert "accel_bias[N]" in by_first["attitude_error[E]"]


def test_with_varying_drifts_the_one_direction_decays(opened: Open) -> None:
    """gamma = 1, eps_x = wy, eps_y = Vy / R_M, eps_z = -1 / tau at s = -1 / tau: bounded, so nothing is warned of."""
    problem = opened("ins_gm9")
    found, F = seen(problem)
    np.testing.assert_allclose(unseen_rates(found, F), [-1 / 3600.0], rtol=1e-6)
    direction = found.kernel[:, 0] / found.kernel[2, 0]
    n = problem.plan.layout.unpack(problem.plan.layout.complete(problem.plan.layout.pack(problem.reference)))
    turn = n["earth_rate_t"] + n["transport_rate_t"]
    due = [0, 0, 1, 0, 0, 0, turn[1], n["velocity_t"][1] * n["meridian_curvature"], -1 / 3600.0]
    np.testing.assert_allclose(direction, due, rtol=0, atol=1e-11)
    assert undetectable_directions(problem.model, problem.reference) == []
