"""A vehicle at rest: it stays where it is, and errors of its start do what the textbook says."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from estimfw_inertial.mechanization import OPERATIONS, correct, pack_params, place_at, step
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]
Mechanized = Callable[..., FloatArray]

RATE = 7.292115e-5
LATITUDE, HEIGHT = np.radians(34.0), 100.0
PLACE = place_at(np.array(LATITUDE), np.array(HEIGHT))
GRAVITY = float(PLACE[2])
EARTH = RATE * np.array([0.0, np.cos(LATITUDE), np.sin(LATITUDE)])
C_BN = Rotation.from_euler("ZXY", [-1.6, 0.1, -0.2]).as_matrix()
AT_REST = np.concatenate([C_BN.ravel(), np.zeros(3), [LATITUDE, 1.9, HEIGHT]])
FOLLOWED = frozenset({"coriolis", "vertical_channel"})


def increments(duration: float, dt: float) -> FloatArray:
    """What perfect sensors of a vehicle at rest give, (N, 6)."""
    of_one = np.concatenate([C_BN.T @ EARTH, C_BN.T @ [0.0, 0.0, GRAVITY]]) * dt
    return np.tile(of_one, (round(duration / dt), 1))


def left_over(step: float) -> FloatArray:
    """m/s^2: specific force turns by two half turns instead of along an arc, to second order; T^2 / 8 omega x (omega x f)."""
    return -(step**2) / 8.0 * np.cross(EARTH, np.cross(EARTH, [0.0, 0.0, GRAVITY]))


@pytest.mark.parametrize("per_step", [1, 2])
def test_an_hour_at_rest_leaves_a_known_trace_in_the_velocity(mechanized: Mechanized, per_step: int) -> None:
    """10 um/s with steps of 1 s, 4 nm/s with those of 0.02 s."""
    end = mechanized(AT_REST, increments(3600.0, 0.5), 0.5, per_step, frozenset({"vertical_channel"}))
    assert Rotation.from_matrix(end[:9].reshape(3, 3) @ C_BN.T).magnitude() < 1e-11
    assert end[9:12] == pytest.approx(3600.0 * left_over(0.5 * per_step), abs=2e-8)
    assert np.array_equal(end[12:], AT_REST[12:])


@pytest.mark.parametrize("computed", [FOLLOWED, frozenset(OPERATIONS)], ids=["standing", "all"])
def test_an_hour_at_rest_changes_next_to_nothing(mechanized: Mechanized, computed: frozenset[str]) -> None:
    """A vertical channel that follows its height is unstable, an e-fold in 570 s; East feels it by Coriolis."""
    trace = 3600.0 * np.linalg.norm(left_over(0.5))
    end = mechanized(AT_REST, increments(3600.0, 0.5), 0.5, 1, computed)
    assert Rotation.from_matrix(end[:9].reshape(3, 3) @ C_BN.T).magnitude() < 2e-9
    assert np.linalg.norm(end[9:11]) < 3.0 * trace
    assert abs(end[11]) < trace * (1.0 if computed == FOLLOWED else np.exp(3600.0 / 570.0))
    assert np.linalg.norm(6.4e6 * (end - AT_REST)[12:14]) < 3600.0 * trace


def test_a_tilt_runs_away_with_g_times_the_tilt(mechanized: Mechanized) -> None:
    """dV_E' = -g phi_N, dV_N' = g phi_E: what the error model calls gravity_tilt."""
    phi = np.array([1e-5, -2e-5, 0.0])
    tilted = AT_REST.copy()
    tilted[:9] = (Rotation.from_rotvec(-phi).as_matrix() @ C_BN).ravel()
    end = mechanized(tilted, increments(10.0, 0.1), 0.1, 2, FOLLOWED)
    assert end[9:11] == pytest.approx([-GRAVITY * phi[1] * 10.0, GRAVITY * phi[0] * 10.0], rel=2e-3)


def test_a_velocity_swings_with_schulers_period_where_the_transport_rate_is_computed(mechanized: Mechanized) -> None:
    """Quarter, half, whole period 2 pi sqrt(R / g) = 84.4 min: V_N is 0, -V, V. The Earth's rate turns the plane slowly."""
    radius = float(PLACE[3])
    period = 2.0 * np.pi * np.sqrt(radius / GRAVITY)
    dt = period / 8192.0
    pushed = AT_REST.copy()
    pushed[10] = 1.0
    computed = frozenset({"transport_rate"})
    still = np.array([0.0, 0.0, GRAVITY, radius, radius, 0.0])
    sensed = np.tile(np.concatenate([np.zeros(3), C_BN.T @ [0.0, 0.0, GRAVITY]]) * dt, (8192, 1))
    found = [mechanized(pushed, sensed[:n], dt, 2, computed, still)[10] for n in (2048, 4096, 8192)]
    assert found == pytest.approx([0.0, -1.0, 1.0], abs=5e-3)


@pytest.mark.parametrize("point", [0.0, 0.5, 1.0])
def test_the_rows_of_a_vehicle_at_rest(point: float) -> None:
    """f_n = (0, 0, g), no turn against n, the Earth's rate: at every point of the interval."""
    sample = np.concatenate([[0.2], np.tile(increments(0.1, 0.1)[0], 2)])
    new, process, end = step(AT_REST, sample, pack_params(2, FOLLOWED, point, PLACE))
    assert new == pytest.approx(AT_REST, abs=1e-10)
    for row in (process, end):
        assert row[:9] == pytest.approx(C_BN.ravel(), abs=1e-4)
        assert row[9:12] == pytest.approx([0.0, 0.0, GRAVITY], abs=2e-4)
        assert row[12:15] == pytest.approx(np.zeros(3), abs=1e-12)
        assert row[15:18] == pytest.approx(np.zeros(3), abs=1e-10)
        assert row[18:] == pytest.approx([*EARTH, 0.0, 0.0, 0.0, GRAVITY], abs=1e-15)


@pytest.mark.parametrize(("point", "fraction"), [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0)])
def test_a_process_row_is_taken_where_the_plan_wants_it(point: float, fraction: float) -> None:
    """A vehicle that turns about Up by 0.2 rad in a step and is pushed forward: C_bn, f_n and V_n at the point, rate 1 rad/s."""
    still = np.array([0.0, 0.0, GRAVITY, 6e6, 6e6, 0.5])
    sample = np.array([0.2, 0.0, 0.0, 0.2, 0.0, 0.4, GRAVITY * 0.2])
    begin = np.concatenate([np.eye(3).ravel(), [3.0, 0.0, 0.0], np.zeros(3)])
    new, row, end = step(begin, sample, pack_params(1, FOLLOWED, point, still))
    turned = Rotation.from_rotvec([0.0, 0.0, 0.2 * fraction])
    assert row[:9] == pytest.approx(turned.as_matrix().ravel(), abs=1e-15)
    assert row[9:12] == pytest.approx(turned.apply([0.0, 2.0, GRAVITY]), abs=1e-12)
    assert row[12:15] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert row[15:18] == pytest.approx(begin[9:12] + fraction * (new[9:12] - begin[9:12]), abs=1e-15)
    assert end[:9] == pytest.approx(Rotation.from_rotvec([0.0, 0.0, 0.2]).as_matrix().ravel(), abs=1e-15)
    assert end[15:18] == pytest.approx(new[9:12], abs=0.0)


def test_correcting_with_the_true_error_gives_the_truth() -> None:
    """computed C = exp(-[phi x]) C, computed V = V + dV, however large."""
    phi, dV = np.array([0.3, -0.2, 0.5]), np.array([1.0, -2.0, 0.5])
    wrong = AT_REST.copy()
    wrong[:9] = (Rotation.from_rotvec(-phi).as_matrix() @ C_BN).ravel()
    wrong[9:12] += dV
    params = pack_params(2, FOLLOWED, 0.5, PLACE)
    assert correct(wrong, np.concatenate([dV, phi]), params) == pytest.approx(AT_REST, abs=1e-15)


def test_a_held_vertical_channel_stays_held_through_a_correction() -> None:
    params = pack_params(2, frozenset({"coriolis"}), 0.5, PLACE)
    assert correct(AT_REST, np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]), params)[9:12].tolist() == [-1.0, -2.0, 0.0]
