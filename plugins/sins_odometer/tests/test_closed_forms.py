"""What the alignment of a vehicle that stands, heading north, makes of single errors, against closed forms (C1 to C4)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimfw_inertial import earth
from estimfw_sins_odometer.determined import BoundDetermination, Determination
from estimfw_sins_odometer.samples import COLUMNS
from estimfw_sins_odometer.vehicle import Vehicle
from numpy.typing import NDArray

from estimfw.data.record import Record, Stream
from estimfw.model.nominal import InitialNominal, ProviderSettings
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]

T, RATE = 600, 2
LATITUDE, HEIGHT = np.radians(34.25), 400.0
G = float(earth.normal_gravity(LATITUDE, HEIGHT))
OMEGA_N = earth.RATE * np.cos(LATITUDE)
VEHICLE = Vehicle(LATITUDE, HEIGHT, RATE)


def standing() -> Stream:
    """Level, forward to the north, sampled twice a second; its first row is the start."""
    rate, force = earth.earth_rate_n(LATITUDE), np.array([0.0, 0.0, G])
    row = np.concatenate([rate / RATE, force / RATE, [0.0]])
    time = np.arange(T * RATE + 1, dtype=np.float64) / RATE
    return Stream("imu", time, np.tile(row, (time.size, 1)), COLUMNS, "increment", 1.0 / RATE)


def heading_after(bound: BoundDetermination, stream: Stream, first_speed: FloatArray, speed: FloatArray) -> FloatArray:
    """Heading (R,) rad at the end of R runs whose speed at the ends of the steps is ``speed`` (R, T), at the start (R,)."""
    rows = np.arange(1, T * RATE + 2, RATE)
    samples = np.repeat(bound.samples(stream, rows)[None], len(speed), axis=0)
    samples[..., 7 * RATE] = speed
    velocity = np.zeros((len(speed), 3))
    velocity[:, 1] = first_speed
    state = bound.initial_state(InitialNominal({"C_bn": np.eye(3), "velocity_b": velocity}))
    for k in range(T):
        state, _, row = bound.step(state, samples[:, k])
    C = row[:, :9].reshape(-1, 3, 3)
    return np.asarray(np.arctan2(C[:, 0, 1], C[:, 1, 1]))


@pytest.fixture(scope="module")
def bound() -> BoundDetermination:
    return Determination(VEHICLE).bind(ProviderSettings(frozenset()))


def test_an_error_of_the_first_speed_alone_turns_the_heading(bound: BoundDetermination) -> None:
    error = 0.1
    found = heading_after(bound, standing(), np.array([error, 0.0]), np.zeros((2, T)))
    expected = -(20.0 / 3.0) * error / (G * OMEGA_N * T**2)
    assert np.degrees(expected) / error == pytest.approx(-1.797, abs=2e-3)
    assert found[0] - found[1] == pytest.approx(expected, rel=0.02)


def test_white_noise_of_the_speed_spreads_the_heading() -> None:
    """The answer is linear in small errors: the spread is the root sum square of what one error at each update does.

    The closed form knows the observation alone; that the same speed turns n over the ground takes 3 % off, so it is left out.
    """
    error, bound = 0.1, Determination(VEHICLE, transport=False).bind(ProviderSettings(frozenset()))
    alone = heading_after(bound, standing(), np.zeros(T + 1), np.concatenate([np.zeros((1, T)), error * np.eye(T)]))
    spread = np.sqrt(np.sum(np.square(alone[1:] - alone[0]))) / error
    expected = 2.0 * np.sqrt(80.0) / (G * OMEGA_N * T**2.5)
    assert np.degrees(expected) == pytest.approx(0.197, abs=1e-3)
    assert spread == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("blocks", "factor"), [((), 80.0), (("initial_speed_error",), 180.0)])
def test_the_filter_knows_that_spread_and_what_an_unknown_first_speed_costs(
    one_start: Any, blocks: tuple[str, ...], factor: float
) -> None:
    dropped = ", ".join({"gyro_bias", "accel_bias", "initial_speed_error"} - set(blocks))
    problem = one_start(
        "preprocess={}",
        f"nominal.rows={RATE}",
        "initial_attitude={kind: sins_odometer.level, heading: 0 deg, window: 2 s, heading_sigma: 60 deg}",
        "blocks.initial_speed_error.sigma=100 m/s",
        "process.phi_i={kind: sins_odometer.phi_i, gyro_noise: 0 rad/sqrt(s)}",
        "measurements.integrated_velocity.noise=0.1 m/s",
        f"policies=[{{kind: drop_states, states: [{dropped}]}}]",
    )
    done = run_problem(problem, record=Record({"imu": standing()}))
    expected = 2.0 * np.sqrt(factor) * 0.1 / (G * OMEGA_N * T**2.5)
    assert done.output_sigma[-1, 0] == pytest.approx(expected, rel=0.02)


def test_an_east_gyro_bias_is_a_wrong_north(bound: BoundDetermination) -> None:
    bias, stream = np.radians(0.01) / 3600.0, standing()
    values = stream.values.copy()
    values[:, 0] += bias / RATE
    off, plain = (
        heading_after(bound, s, np.zeros(1), np.zeros((1, T)))[0] for s in (replace(stream, values=values), stream)
    )
    assert np.degrees(-bias / OMEGA_N) == pytest.approx(-0.0461, abs=2e-4)
    assert off - plain == pytest.approx(-bias / OMEGA_N, rel=0.02)
