"""The mechanization against differential equations that SciPy integrates: in an Earth-fixed frame, and in n term by term."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.mechanization import OPERATIONS
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]
Mechanized = Callable[..., FloatArray]

A, F, RATE = 6378137.0, 1.0 / 298.257223563, 7.292115e-5
E2 = F * (2.0 - F)
LATITUDE, LONGITUDE, HEIGHT = 0.6, 1.9, 400.0
SUBSETS = [frozenset(c) for n in range(5) for c in combinations(OPERATIONS, n)]


def skew(v: FloatArray) -> FloatArray:
    return np.cross(np.eye(3), v)


def gravity(latitude: float, height: float) -> float:
    """Normal gravity of WGS-84, with its second-order continuation upwards."""
    s = np.sin(latitude) ** 2
    surface = 9.7803253359 * (1.0 + 0.00193185265241 * s) / np.sqrt(1.0 - E2 * s)
    u = height / A
    return float(surface * (1.0 - 2.0 * (1.0 + F + 0.00344978650684 - 2.0 * F * s) * u + 3.0 * u**2))


def radii(latitude: float) -> tuple[float, float]:
    """R_M, R_N in m."""
    w2 = 1.0 - E2 * np.sin(latitude) ** 2
    return A * (1.0 - E2) / w2**1.5, A / np.sqrt(w2)


def start(yaw: float = 0.7, velocity: tuple[float, float, float] = (60.0, -40.0, 5.0)) -> FloatArray:
    C = Rotation.from_euler("ZXY", [yaw, 0.1, -0.2]).as_matrix()
    return np.concatenate([C.ravel(), velocity, [LATITUDE, LONGITUDE, HEIGHT]])


# --- in an Earth-fixed frame: Newton, with no radius of curvature and no transport rate anywhere ----------------------


def ecef_of(latitude: float, longitude: float, height: float) -> FloatArray:
    N = radii(latitude)[1]
    east = (N + height) * np.cos(latitude)
    return np.array([east * np.cos(longitude), east * np.sin(longitude), (N * (1.0 - E2) + height) * np.sin(latitude)])


def geodetic_of(r: FloatArray) -> tuple[float, float, float]:
    """Latitude, longitude, height by fixed-point iteration to the last digits."""
    p, latitude = float(np.hypot(r[0], r[1])), float(np.arctan2(r[2], np.hypot(r[0], r[1])))
    for _ in range(8):
        latitude = float(np.arctan2(r[2] + E2 * radii(latitude)[1] * np.sin(latitude), p))
    height = p * np.cos(latitude) + r[2] * np.sin(latitude) - A**2 / radii(latitude)[1]
    return latitude, float(np.arctan2(r[1], r[0])), float(height)


def C_ne(latitude: float, longitude: float) -> FloatArray:
    """Columns: East, North, Up in e."""
    sL, cL, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    return np.array([[-sl, -sL * cl, cL * cl], [cl, -sL * sl, cL * sl], [0.0, cL, sL]])


def integrated_in_ecef(state: FloatArray, motion: Any, duration: float) -> FloatArray:
    """The state (15,) at the end, through r'' = C f + gravity - 2 omega x r' in e."""
    W = RATE * skew(np.array([0.0, 0.0, 1.0]))

    def slope(t: float, y: FloatArray) -> FloatArray:
        C, u = y[:9].reshape(3, 3), motion.at(t)
        latitude, longitude, height = geodetic_of(y[12:])
        down = -gravity(latitude, height) * C_ne(latitude, longitude)[:, 2]
        return np.concatenate([(C @ skew(u[:3]) - W @ C).ravel(), C @ u[3:] + down - 2.0 * W @ y[9:12], y[9:12]])

    turn = C_ne(*state[12:14])
    begin = np.concatenate([
        (turn @ state[:9].reshape(3, 3)).ravel(), turn @ state[9:12], ecef_of(*state[12:]),
    ])  # fmt: skip
    end = solve_ivp(slope, (0.0, duration), begin, method="DOP853", rtol=1e-12, atol=1e-9).y[:, -1]
    place = geodetic_of(end[12:])
    back = C_ne(*place[:2]).T
    return np.concatenate([(back @ end[:9].reshape(3, 3)).ravel(), back @ end[9:12], place])


def apart(found: FloatArray, expected: FloatArray) -> tuple[float, float, float]:
    """Attitude (rad), velocity (m/s) and position (m) between two states."""
    turn = Rotation.from_matrix(found[:9].reshape(3, 3) @ expected[:9].reshape(3, 3).T).magnitude()
    metres = np.array([A, A * np.cos(LATITUDE), 1.0]) * (found[12:] - expected[12:])
    return float(turn), float(np.linalg.norm(found[9:12] - expected[9:12])), float(np.linalg.norm(metres))


def extrapolated(mechanized: Mechanized, begin: FloatArray, motion: Any, duration: float, **more: Any) -> FloatArray:
    """The limit of short steps, by Richardson's extrapolation.

    Rates and Coriolis take V at the start of a step, an error of first order; f is turned to second order in the angle.
    """
    one, half, quarter = (
        mechanized(begin, motion.increments(duration, dt), dt, **more) for dt in (0.01, 0.005, 0.0025)
    )
    return np.asarray((8.0 * quarter - 6.0 * half + one) / 3.0)


def test_everything_computed_is_newtons_law_on_the_ellipsoid(mechanized: Mechanized, lively: Any) -> None:
    expected = integrated_in_ecef(start(), lively, 30.0)
    assert np.linalg.norm(expected[9:11] - start()[9:11]) > 20.0
    turn, velocity, position = apart(extrapolated(mechanized, start(), lively, 30.0), expected)
    assert turn < 1e-11
    assert velocity < 1e-7
    assert position < 1e-6


def test_a_step_of_20_ms_is_off_by_what_v_at_its_start_instead_of_its_middle_does(
    mechanized: Mechanized, lively: Any
) -> None:
    """The transport rate lags by half a step: T / 2 times the change of V, over the Earth's radius."""
    expected = integrated_in_ecef(start(), lively, 30.0)
    turn, _, _ = apart(mechanized(start(), lively.increments(30.0, 0.01), 0.01), expected)
    change = float(np.linalg.norm(expected[9:12] - start()[9:12]))
    assert 0.2 < turn / (0.01 * change / A) < 2.0


# --- in n, with what is computed and without what is not -------------------------------------------------------------------


def integrated_in_n(state: FloatArray, motion: Any, duration: float, computed: frozenset[str]) -> FloatArray:
    """The state at the end, through the equations of the module with some operations left out."""

    def slope(t: float, y: FloatArray) -> FloatArray:
        C, V, u = y[:9].reshape(3, 3), y[9:12], motion.at(t)
        latitude, _, height = y[12:] if "position_update" in computed else state[12:]
        (R_M, R_N), tangent = radii(latitude), np.tan(latitude)
        earth = RATE * np.array([0.0, np.cos(latitude), np.sin(latitude)])
        over = np.array([-V[1] / (R_M + height), V[0] / (R_N + height), V[0] * tangent / (R_N + height)])
        transport = over if "transport_rate" in computed else np.zeros(3)
        dV = C @ u[3:] - np.array([0.0, 0.0, gravity(latitude, height)])
        if "coriolis" in computed:
            dV -= np.cross(2.0 * earth + transport, V)
        if "vertical_channel" not in computed:
            dV[2] = 0.0
        dC = C @ skew(u[:3]) - skew(earth + transport) @ C
        path = np.array([V[1] / (R_M + height), V[0] / (R_N + height) / np.cos(latitude), V[2]])
        return np.concatenate([dC.ravel(), dV, path if "position_update" in computed else np.zeros(3)])

    return np.asarray(solve_ivp(slope, (0.0, duration), state, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1])


@pytest.mark.parametrize("computed", SUBSETS, ids=lambda c: "+".join(sorted(c)) or "nothing")
def test_each_operation_alone_and_with_others(mechanized: Mechanized, lively: Any, computed: frozenset[str]) -> None:
    begin = start()
    if "vertical_channel" not in computed:
        begin[11] = 0.0
    expected = integrated_in_n(begin, lively, 4.0, computed)
    turn, velocity, position = apart(extrapolated(mechanized, begin, lively, 4.0, computed=computed), expected)
    assert turn < 1e-11
    assert velocity < 1e-7
    assert position < 1e-6


@pytest.mark.parametrize("operation", OPERATIONS)
def test_what_an_operation_does_is_far_above_those_tolerances(lively: Any, operation: str) -> None:
    """So that the test before could not pass with the operation left out."""
    begin = start(velocity=(60.0, -40.0, 0.0))
    whole = integrated_in_n(begin, lively, 4.0, frozenset(OPERATIONS))
    turn, velocity, position = apart(integrated_in_n(begin, lively, 4.0, frozenset(OPERATIONS) - {operation}), whole)
    assert turn > 1e-8 or velocity > 1e-4 or position > 1e-3


def test_the_two_integrations_agree_where_everything_is_computed(lively: Any) -> None:
    turn, velocity, position = apart(
        integrated_in_n(start(), lively, 30.0, frozenset(OPERATIONS)), integrated_in_ecef(start(), lively, 30.0)
    )
    assert turn < 1e-10
    assert velocity < 1e-6
    assert position < 1e-4
