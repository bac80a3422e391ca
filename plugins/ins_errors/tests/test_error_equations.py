"""Every coefficient of the error model against the expressions of the specification, and against the exact platform equations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from estimfw_ins_errors.local_level import LEFT_OUT
from estimfw_ins_errors.recorded_step import error_rate
from numpy.typing import NDArray

from estimfw.config.compose import Problem

Open = Callable[..., Problem]
ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

A, E2, OMEGA, G = 6378137.0, 6.69437999014e-3, 7.292115e-5, 9.80665
KNOT = 1852.0 / 3600.0
#: Latitude, V_E, V_N: the point of the paper, and others.
POINTS = [
    (np.pi / 4, 20 * KNOT * np.sin(np.pi / 4), 20 * KNOT * np.cos(np.pi / 4)),
    (0.0, 3.0, -8.0),
    (-1.2, -250.0, 40.0),
    (1.4, 30.0, 200.0),
    (0.6, 0.0, 0.0),
]
LONGITUDE = "blocks.longitude_error={kind: ins_errors.longitude_error, sigma: 1 arcmin}"


def radii(L: complex) -> tuple[complex, complex]:
    w = 1.0 - E2 * np.sin(L) ** 2
    return A * (1.0 - E2) / w**1.5, A / w**0.5


def nominal(problem: Problem, L: float, V_E: float, V_N: float) -> dict[str, FloatArray]:
    """The nominal of an even motion, with its derived variables."""
    layout = problem.plan.layout
    values = {**problem.reference, "latitude": np.array(L), "velocity_t": np.array([V_E, V_N])}
    return layout.unpack(layout.complete(layout.pack(values)))


def equation_1(L: float, Vx: float, Vy: float) -> FloatArray:
    """Section 2 as it stands there: rates of alpha, beta, gamma, dVx, dVy, dphi, dlam over the first six."""
    R_M, R_N = (float(np.real(r)) for r in radii(L))
    s, c, t = np.sin(L), np.cos(L), np.tan(L)
    wy, wz = OMEGA * c + Vx / R_N, OMEGA * s + Vx * t / R_N
    k = 2 * OMEGA * c + Vx / c**2 / R_N
    return np.array([
        [0, wz, -wy, 0, -1 / R_M, 0],
        [-wz, 0, -Vy / R_M, 1 / R_N, 0, -OMEGA * s],
        [wy, Vy / R_M, 0, t / R_N, 0, OMEGA * c + Vx / c**2 / R_N],
        [0, -G, 0, Vy * t / R_N, 2 * OMEGA * s + Vx * t / R_N, k * Vy],
        [G, 0, 0, -2 * (OMEGA * s + Vx * t / R_N), 0, -k * Vx],
        [0, 0, 0, 0, 1 / R_M, 0],
        [0, 0, 0, 1 / c / R_N, 0, Vx / R_N * t / c],
    ])  # fmt: skip


def left_out(L: float, Vx: float, Vy: float) -> FloatArray:
    """What section 2 adds to it: f other than (0, 0, g), and radii that change with the latitude."""
    R_M, R_N = (float(np.real(r)) for r in radii(L))
    s, c, t = np.sin(L), np.cos(L), np.tan(L)
    w = 1 - E2 * s**2
    dM, dN = 3 * R_M * E2 * s * c / w / R_M**2, R_N * E2 * s * c / w / R_N**2
    fx, fy = -(2 * OMEGA * s + Vx * t / R_N) * Vy, (2 * OMEGA * s + Vx * t / R_N) * Vx
    fz = G - (2 * OMEGA * c + Vx / R_N) * Vx - Vy**2 / R_M
    return np.array([
        [0, 0, 0, 0, 0, Vy * dM],
        [0, 0, 0, 0, 0, -Vx * dN],
        [0, 0, 0, 0, 0, -Vx * t * dN],
        [0, -(fz - G), fy, 0, 0, -Vx * Vy * t * dN],
        [fz - G, 0, -fx, 0, 0, Vx**2 * t * dN],
        [0, 0, 0, 0, 0, -Vy * dM],
        [0, 0, 0, 0, 0, -Vx * dN / c],
    ])  # fmt: skip


def turned(phi: ComplexArray) -> ComplexArray:
    """exp(-[phi x]) of a rotation vector, by its series: complex steps go through it."""
    x, y, z = phi
    K = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    total, term = np.eye(3, dtype=complex), np.eye(3, dtype=complex)
    for k in range(1, 12):
        term = term @ K / k
        total = total + term
    return total


def rates(L: complex, Vx: complex, Vy: complex) -> tuple[ComplexArray, ComplexArray]:
    """omega_it and 2 omega_ie + omega_et."""
    R_M, R_N = radii(L)
    earth = np.array([0, OMEGA * np.cos(L), OMEGA * np.sin(L)], dtype=complex)
    transport = np.array([-Vy / R_M, Vx / R_N, Vx * np.tan(L) / R_N])
    return earth + transport, 2 * earth + transport


def exact_rates(error: ComplexArray, L: float, Vx: float, Vy: float) -> ComplexArray:
    """d/dt of (phi, dV, dphi, dlam) of an INS with these errors whose vehicle moves evenly; phi is 0 where errors are taken at.

    omega_tp is the rate of the rotation vector phi = 0 itself; for small phi, C' = -[omega_tp x] C gives phi' = omega_tp to first
    order in phi, which is all that a derivative at 0 needs.
    """
    C = turned(error[:3])
    own, E, N = L + error[5], Vx + error[3], Vy + error[4]
    true_turn, coriolis = rates(L, Vx, Vy)
    f = np.cross(coriolis, [Vx, Vy, 0]) + np.array([0, 0, G])
    command, own_coriolis = rates(own, E, N)
    turn = command - C @ true_turn
    push = C @ f - np.cross(own_coriolis, np.array([E, N, 0]))
    R_M, R_N = radii(own)
    true_M, true_N = radii(L)
    place = [N / R_M - Vy / true_M, E / (R_N * np.cos(own)) - Vx / (true_N * np.cos(L))]
    return np.concatenate([turn, push[:2], place])


def jacobian(L: float, Vx: float, Vy: float) -> FloatArray:
    """By complex steps, (7, 6)."""
    step = 1e-30
    columns = []
    for i in range(6):
        error = np.zeros(6, dtype=complex)
        error[i] = 1j * step
        columns.append(exact_rates(error, L, Vx, Vy).imag / step)
    return np.stack(columns, axis=-1)


def dynamics(problem: Problem, point: tuple[float, float, float]) -> FloatArray:
    """F, rows alpha to dlam, columns alpha to dphi."""
    F = problem.model.F.coefficient.evaluate(nominal(problem, *point))
    rows = [problem.model.states.index(s) for s in problem.model.states if "bias" not in s]
    return np.asarray(F[np.ix_(rows, rows[:6])])


def assert_entries(found: FloatArray, due: FloatArray, rounding: float) -> None:
    """Each to 1e-12 of itself, or to what is left where larger numbers cancel."""
    np.testing.assert_array_less(np.abs(found - due), 1e-12 * np.abs(due) + rounding)


@pytest.mark.parametrize("point", POINTS)
def test_every_entry_of_equation_1(opened: Open, point: tuple[float, float, float]) -> None:
    found = dynamics(opened("ins_const11", LONGITUDE), point)
    due = equation_1(*point)
    assert_entries(found, due, 1e-300)
    np.testing.assert_array_equal(found == 0.0, due == 0.0)


@pytest.mark.parametrize("point", POINTS)
def test_every_entry_of_the_complete_model(opened: Open, point: tuple[float, float, float]) -> None:
    complete = dynamics(opened("ins_const11", LONGITUDE, "process.local_level.terms=complete"), point)
    assert_entries(complete, equation_1(*point) + left_out(*point), 1e-18)
    paper = dynamics(opened("ins_const11", LONGITUDE), point)
    assert_entries(complete - paper, left_out(*point), 1e-14 * G)


@pytest.mark.parametrize("point", POINTS)
def test_the_complete_model_is_the_derivative_of_the_exact_equations(
    opened: Open, point: tuple[float, float, float]
) -> None:
    found = dynamics(opened("ins_const11", LONGITUDE, "process.local_level.terms=complete"), point)
    due = jacobian(*point)
    assert_entries(found, due, 1e-18)


def test_equation_1_leaves_out_what_the_specification_says(opened: Open) -> None:
    """At the point of the paper f = (-7.59e-4, 7.59e-4, 9.80588): 8e-5 of g, 7.6e-4 m/s^2 per rad of gamma."""
    at = nominal(opened("ins_const11"), *POINTS[0])
    np.testing.assert_allclose(at["motion_force_t"][:2], [-7.59e-4, 7.59e-4], atol=5e-7)
    assert G + float(at["motion_force_t"][2]) == pytest.approx(9.80588, abs=5e-6)
    difference = jacobian(*POINTS[0]) - dynamics(opened("ins_const11", LONGITUDE), POINTS[0])
    assert abs(difference[3, 1] / G) == pytest.approx(8e-5, rel=0.05)
    assert difference[3, 2] == pytest.approx(7.6e-4, rel=0.01)


def test_the_policy_makes_equation_1_of_the_complete_model(opened: Open) -> None:
    reduced = opened(
        "ins_const11", LONGITUDE, "process.local_level.terms=complete", "policies=[ins_errors.paper_terms]"
    )
    assert reduced.changes[0].removed_terms == LEFT_OUT
    assert reduced.changes[0].kind == "approximate"
    assert reduced.model.F == opened("ins_const11", LONGITUDE).model.F


def test_drifts_add_with_plus_as_those_of_a_gimballed_platform(opened: Open) -> None:
    model = opened("ins_full14").model
    F = model.F.coefficient.evaluate(nominal(opened("ins_full14"), *POINTS[0]))
    at = {label: i for i, label in enumerate(model.states)}
    for axis in ("E", "N", "U"):
        for block in ("gyro_bias", "gyro_drift"):
            assert F[at[f"attitude_error[{axis}]"], at[f"{block}[{axis}]"]] == 1.0
    for axis in ("E", "N"):
        assert F[at[f"velocity_error[{axis}]"], at[f"accel_bias[{axis}]"]] == 1.0


def test_undamped_periods_at_rest_at_45_degrees(opened: Open) -> None:
    """23.9345 h, and Schuler's 1.40755 h split by the Foucault rate of 33.848 h into 1.46731 and 1.35022 h."""
    problem = opened("ins_6")
    F = problem.model.F.coefficient.evaluate(nominal(problem, np.pi / 4, 0.0, 0.0))
    turns = np.linalg.eigvals(F)
    periods = np.sort(2 * np.pi / np.abs(turns.imag[np.abs(turns) > 1e-9]) / 3600.0)[::-2]
    np.testing.assert_array_less(np.abs(periods[:3] - [23.9345, 1.46731, 1.35022]), [5e-5, 5e-6, 5e-6])
    assert np.max(np.abs(turns.real)) < 1e-12


@pytest.mark.parametrize("point", POINTS[:4])
def test_the_correction_of_the_provider_moves_by_the_exact_equations(point: tuple[float, float, float]) -> None:
    """Errors of any size, of an INS whose vehicle moves evenly: as `exact_rates` has them, and the rotation vector with them."""
    L, V_E, V_N = point
    c = np.array([2e-3, -3e-3, 9e-3, 6.0, -7.0, 5e-3, 0.0])
    due = exact_rates(c[:6].astype(complex), L, V_E, V_N).real
    recorded = np.array([L + c[5], 0.0, V_E + c[3], V_N + c[4], 0.0])
    found = error_rate(c, recorded, due[3:5], G)
    np.testing.assert_allclose(found[3:], due[3:], rtol=1e-9, atol=1e-15)
    step = 1e-3
    ends = [turned((c[:3] + sign * step * found[:3]).astype(complex)).real for sign in (1.0, -1.0)]
    x, y, z = due[:3]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    np.testing.assert_allclose(
        (ends[0] - ends[1]) / (2.0 * step), -cross @ turned(c[:3].astype(complex)).real, rtol=0, atol=1e-12
    )
