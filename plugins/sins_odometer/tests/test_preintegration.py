"""Preintegration and the observation made of it, against the motion that was simulated, a naive loop and finite differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.rotation import exponential, skew
from estimfw_sins_odometer.observation import predicted
from estimfw_sins_odometer.preintegration import Preintegrated, begin, preintegrate, velocity_observation
from estimfw_sins_odometer.samples import odometer_samples
from estimfw_sins_odometer.vehicle import Vehicle
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.data.record import Record

FloatArray = NDArray[np.float64]
STILL = np.zeros(3)
EARTH = 7.292115e-5


def integrated(record: Record, seconds: int, start: int = 0) -> Preintegrated:
    """From a row on over whole seconds, in one go."""
    stream = record.streams["imu"]
    sample = odometer_samples(stream, np.array([start + 1, start + 1 + 100 * seconds]), 100 * seconds, np.eye(3))[0]
    speed = stream.values[start, 6]
    return Preintegrated.of(preintegrate(begin(np.array([0.0, speed, 0.0])), sample, STILL)[0])


def to_inertial(record: Record, row: int) -> FloatArray:
    """True rotation from n to axes fixed in space, by the place and the Earth's turn."""
    assert record.truth is not None
    L, longitude, _ = record.truth.values["position"][row]
    angle = longitude + EARTH * record.truth.time[row]
    east = [-np.sin(angle), np.cos(angle), 0.0]
    north = [-np.sin(L) * np.cos(angle), -np.sin(L) * np.sin(angle), np.cos(L)]
    up = [np.cos(L) * np.cos(angle), np.cos(L) * np.sin(angle), np.sin(L)]
    return np.array([east, north, up]).T


def true_C_ni(record: Record, row: int, start: int = 0) -> FloatArray:
    """C_ni of the truth, i being the body axes at ``start``."""
    assert record.truth is not None
    begin_n = to_inertial(record, start) @ record.truth.values["C_bn"][start]
    return np.asarray(begin_n.T @ to_inertial(record, row))


@pytest.mark.parametrize("seed", [1, 2])
def test_the_gyros_alone_keep_the_axes_of_the_start(drive: Any, seed: int) -> None:
    record, row = drive(seed=seed, duration="120 s"), 10_000
    now = integrated(record, 100)
    wrong = now.C_bi @ record.truth.values["C_bn"][row].T @ true_C_ni(record, row).T
    assert np.linalg.norm(Rotation.from_matrix(wrong).as_rotvec()) < np.radians(1e-4)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_observation_is_that_of_the_true_attitude(drive: Any, vehicle: Vehicle, seed: int) -> None:
    record = drive(seed=seed)
    for seconds in (100, 300, 600):
        now, A = integrated(record, seconds), true_C_ni(record, 100 * seconds)
        h, _ = predicted(A, now, vehicle.params(True))
        wrong = A.T @ (velocity_observation(now) - h)
        assert np.max(np.abs(wrong[:2])) < 5e-2, "the latitude is held at that of the start"


def test_a_drive_at_a_constant_latitude_is_observed_to_a_millimetre_a_second(drive: Any, vehicle: Vehicle) -> None:
    record = drive(seed=4, duration="62 s")
    now, A = integrated(record, 60), true_C_ni(record, 6000)
    h, _ = predicted(A, now, vehicle.params(True))
    assert np.max(np.abs((A.T @ (velocity_observation(now) - h))[:2])) < 1e-3


def test_the_observation_without_the_transport_rate_misses_the_turn_of_the_vertical(
    drive: Any, vehicle: Vehicle
) -> None:
    record = drive(seed=1)
    now, A = integrated(record, 600), true_C_ni(record, 60_000)
    h, _ = predicted(A, now, vehicle.params(False))
    assert np.max(np.abs((A.T @ (velocity_observation(now) - h))[:2])) > 1.0


def test_the_derivative_is_that_of_central_differences(drive: Any, vehicle: Vehicle) -> None:
    record, rng = drive(seed=1), np.random.default_rng(1)
    now, params = integrated(record, 300), vehicle.params(True)
    for _ in range(20):
        A = np.asarray(Rotation.random(random_state=rng).as_matrix())
        _, H = predicted(A, now, params)
        step, columns = 1e-4, []
        for axis in np.eye(3):
            plus, minus = (predicted(exponential(s * axis) @ A, now, params)[0] for s in (step, -step))
            twice, back = (predicted(exponential(2 * s * axis) @ A, now, params)[0] for s in (step, -step))
            columns.append((8.0 * (plus - minus) - (twice - back)) / (12.0 * step))
        assert np.max(np.abs(np.array(columns).T - H)) < 1e-8 * np.max(np.abs(H))


def test_biases_move_the_observation_as_their_sensitivities_say(drive: Any) -> None:
    record = drive(seed=1, duration="120 s")
    stream = record.streams["imu"]
    now = integrated(record, 100)
    J = skew(now.r) @ now.M_g - now.N_g
    gyro, accel = np.radians([0.3, -0.2, 0.1]) / 3600.0, np.array([1e-3, 2e-3, -1e-3])
    off = stream.values.copy()
    off[:, :3] += 0.01 * gyro
    off[:, 3:6] += 0.01 * accel
    biased = integrated(replace(record, streams={"imu": replace(stream, values=off)}), 100)
    moved = velocity_observation(biased) - velocity_observation(now)
    assert moved == pytest.approx(-J @ gyro - now.M_g @ accel, abs=1e-4)
    turned = Rotation.from_matrix(biased.C_bi @ now.C_bi.T).as_rotvec()
    assert turned == pytest.approx(now.M_g @ gyro, abs=1e-8)


def test_one_step_of_many_rows_is_many_steps_of_few(drive: Any) -> None:
    stream = drive(seed=2, duration="30 s").streams["imu"]
    whole = preintegrate(
        begin(np.array([0.0, 5.0, 0.0])), odometer_samples(stream, np.array([1, 1001]), 1000, np.eye(3))[0], STILL
    )
    state = begin(np.array([0.0, 5.0, 0.0]))
    for sample in odometer_samples(stream, np.arange(1, 1002, 20), 20, np.eye(3)):
        state, rate = preintegrate(state, sample, STILL)
    assert state == pytest.approx(whole[0], rel=1e-10, abs=1e-10)
    assert rate == pytest.approx(whole[1], rel=1e-9, abs=1e-12)


def test_integrals_of_a_straight_drive_are_those_of_school() -> None:
    """Constant speed v on an axis that does not turn: S = vt, Q1 = vt^2/2, Q2 = vt^3/6."""
    v, t, rows = 7.0, 10.0, 1000
    sample = np.concatenate([[t], np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, v], rows)])
    now = Preintegrated.of(preintegrate(begin(np.array([0.0, v, 0.0])), sample, STILL)[0])
    assert pytest.approx([0.0, v * t, 0.0]) == now.S
    assert pytest.approx([0.0, v * t**2 / 2, 0.0]) == now.Q1
    assert pytest.approx([0.0, v * t**3 / 6, 0.0], rel=1e-5) == now.Q2
    assert now.M_g == pytest.approx(t * np.eye(3))


def test_an_odometer_on_a_lever_arm_gives_the_velocity_of_the_imu(drive: Any) -> None:
    arm = (0.4, -1.5, -0.3)
    record = drive(seed=1, duration="60 s", lever_arm=tuple(f"{x} m" for x in arm))
    stream, truth = record.streams["imu"], record.truth
    sample = odometer_samples(stream, np.array([1, 3001]), 3000, np.eye(3))[0]
    now = Preintegrated.of(preintegrate(begin(np.zeros(3)), sample, np.array(arm))[0])
    assert truth is not None
    v_b = truth.values["C_bn"][3000].T @ truth.values["velocity_n"][3000]
    assert now.C_bi.T @ now.r == pytest.approx(v_b, abs=2e-3)
