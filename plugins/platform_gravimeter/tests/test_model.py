"""The error model is that of the specification, and the linear part of the exact platform."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from estimfw_platform_gravimeter.exact import motion, platform_rates
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.config.compose import Problem
from estimfw.testing import check_outputs, check_provider

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]

RATE, R, G, L = 7.292115e-5, 6371000.0, 9.80665, np.radians(39.1)


def specified(alpha: float) -> FloatArray:
    """F of the specification over [dVx dVy phi_x phi_y phi_z dA_x dA_y eps_x eps_y eps_z], x East and y North."""
    up, north, c, s = RATE * np.sin(L), RATE * np.cos(L), np.cos(alpha), np.sin(alpha)
    F = np.zeros((10, 10))
    F[0, [1, 3, 5, 6]] = 2.0 * up, -G, c, -s
    F[1, [0, 2, 5, 6]] = -2.0 * up, G, s, c
    F[2, [3, 4, 1, 7, 8]] = up, -north, -1.0 / R, c, -s
    F[3, [2, 0, 7, 8]] = -up, 1.0 / R, s, c
    F[4, [2, 0, 9]] = north, np.tan(L) / R, 1.0
    return F


def model_matrices(problem: Problem) -> tuple[FloatArray, FloatArray, FloatArray]:
    """F, D and H at the reference nominal."""
    plan = problem.plan
    row = plan.layout.complete(plan.layout.pack(problem.reference))
    return plan.F.evaluate(row), plan.D.evaluate(row), plan.design(row)


@pytest.mark.parametrize("alpha", [0.0, 30.0, -75.0, 200.0])
def test_F_D_and_H_are_those_of_the_specification(opened: Open, alpha: float) -> None:
    problem = opened("gravimeter", f"nominal.alpha={alpha} deg")
    assert [b.name for b in problem.model.blocks for _ in b.axes] == [
        *["velocity_error"] * 2, *["attitude_error"] * 3, *["accel_bias"] * 2, *["gyro_drift"] * 3,
    ]  # fmt: skip
    F, D, H = model_matrices(problem)
    np.testing.assert_allclose(F, specified(np.radians(alpha)), rtol=1e-12, atol=1e-18)
    accel, gyro = (5.0 * 9.80665e-6) ** 2, (np.radians(0.001) / 60.0) ** 2
    np.testing.assert_allclose(D, np.diag(np.repeat([accel, gyro, 0.0], [2, 3, 5])), rtol=1e-12, atol=0.0)
    np.testing.assert_array_equal(H, np.eye(2, 10))
    prior = problem.model.prior.evaluate(problem.reference)[1]
    degree, ug = np.pi / 180.0, 9.80665e-6
    sigma = [0.1, 0.1, 0.1 * degree, 0.1 * degree, degree, 50 * ug, 50 * ug, *[0.02 * degree / 3600.0] * 3]
    np.testing.assert_allclose(prior, np.diag(np.square(sigma)), rtol=1e-12)


def test_one_position_is_time_invariant_and_the_noises_do_not_see_how_it_is_turned(opened: Open) -> None:
    assert opened("gravimeter").plan.time_invariant
    turned = opened("gravimeter_two_positions").plan
    assert turned.pace == "stepped"
    assert {what for what, _, _ in turned.varying} == {"accel_bias_coupling", "gyro_drift_coupling"}


def rates(x: NDArray[Any], alpha: float) -> NDArray[Any]:
    """Of the exact platform at this angle: x of (V_E, V_N, phi, dA, eps), (10,)."""
    c, s = np.cos(alpha), np.sin(alpha)
    C = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    earth = RATE * np.array([0.0, np.cos(L), np.sin(L)])
    return np.array(platform_rates(x[:5], x[5:], C, earth, np.array([G, 1.0 / R, np.tan(L)])))


@pytest.mark.parametrize("alpha", [0.0, 30.0, 200.0])
def test_F_is_the_complex_step_jacobian_of_the_exact_platform(opened: Open, alpha: float) -> None:
    F, _, _ = model_matrices(opened("gravimeter", f"nominal.alpha={alpha} deg"))
    jacobian = np.stack([rates(x, np.radians(alpha)).imag / 1e-30 for x in 1e-30j * np.eye(10)], axis=1)
    np.testing.assert_allclose(jacobian, F[:5], rtol=1e-13, atol=1e-15)  # g times what cos^2 + sin^2 misses 1 by


def test_what_the_error_model_leaves_out_goes_with_the_square_of_the_errors() -> None:
    """A hundred times the errors, ten thousand times the difference: no linear term is missing or wrong."""
    alpha, direction = np.radians(30.0), np.array([1.0, -2.0, 3e-3, -2e-3, 5e-3, 1e-3, -2e-3, 1e-6, 2e-6, -1e-6])

    def left(size: float) -> FloatArray:
        return np.asarray(rates(size * direction, alpha) - specified(alpha)[:5] @ (size * direction))

    np.testing.assert_allclose(left(1.0), 1e4 * left(0.01), rtol=0.05, atol=1e-4 * float(np.max(np.abs(left(1.0)))))


@pytest.mark.parametrize("angle", [0.0999, 0.1001, 1.0, 3.0])
def test_a_large_tilt_turns_as_the_rotation_matrix_does(angle: float) -> None:
    """The rotation vector, by series and by closed forms, against SciPy's product of turns."""
    earth, drift, seconds = np.array([0.0, 0.3, 0.4]), np.array([0.2, -0.1, 0.3]), 0.2
    phi = angle * np.array([0.6, 0.0, 0.8])
    steps, out = 400, np.empty((1, 400, 5))
    sensors = np.broadcast_to(np.concatenate([np.zeros(2), drift]), (1, steps, 5)).copy()
    C, place = np.broadcast_to(np.eye(3), (steps, 3, 3)).copy(), np.broadcast_to([G, 0.0, 0.0], (steps, 3)).copy()
    start = np.concatenate([np.zeros(2), phi])[None]
    motion(start, sensors, C, np.tile(earth, (steps, 1)), place, np.full(steps, seconds / steps), out)
    # The computed platform turns with the Earth, the real one in its own axes with the drift besides.
    back, own = Rotation.from_rotvec(-earth * seconds), Rotation.from_rotvec((earth + drift) * seconds)
    np.testing.assert_allclose(
        out[0, -1, 2:], (back * Rotation.from_rotvec(phi) * own).as_rotvec(), rtol=0.0, atol=1e-11
    )


def test_the_provider_and_the_outputs_keep_their_contracts(opened: Open) -> None:
    for name in ("gravimeter", "gravimeter_two_positions"):
        check_provider(opened(name))
        check_outputs(opened(name))
