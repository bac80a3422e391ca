"""IMU errors: each has the statistics that its name promises, and the truth that is handed over is what was added."""

from __future__ import annotations

import numpy as np
import pytest
from estimfw_inertial.imu_errors import ImuErrors, SensorErrors, apply, gauss_markov, quantised
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

PERIOD = 0.01
RUNS, COUNT = 4000, 50
STILL = np.zeros((RUNS, COUNT, 6))
#: Deviations of a sample mean and of a sample variance that a right simulation stays within (one in 10 000 does not).
FOUR = 4.0


def measured(sensor: SensorErrors, true: FloatArray = STILL, seed: int = 1, period: float = PERIOD) -> FloatArray:
    """Of gyros and accelerometers with the same errors."""
    return apply(true, period, np.random.default_rng(seed), ImuErrors(sensor, sensor))[0]


def test_no_errors_leave_every_bit() -> None:
    true = np.random.default_rng(0).normal(size=(3, 20, 6))
    found, realised = apply(true, PERIOD, np.random.default_rng(1), ImuErrors())
    assert np.array_equal(found, true)
    assert not realised.gyro.bias.any()
    assert not realised.accel.scale_factor.any()


def test_white_noise_is_a_random_walk_of_the_integral() -> None:
    """Its variance is the density squared times the time, whatever the rate; samples, axes and sensors are independent."""
    for period in (0.01, 0.1):
        walk = np.cumsum(measured(SensorErrors(random_walk=3e-3), period=period), axis=1)
        variance = np.mean(walk**2, axis=0) / (9e-6 * period * np.arange(1, COUNT + 1)[:, None])
        assert np.abs(variance - 1.0).max() < 1.3 * FOUR * np.sqrt(2.0 / RUNS)
    steps = np.diff(walk, axis=1, prepend=0.0).reshape(-1, 6)
    assert np.abs(np.corrcoef(steps.T) - np.eye(6)).max() < 5.0 / np.sqrt(len(steps))
    assert abs(np.corrcoef(steps[1:, 0], steps[:-1, 0])[0, 1]) < FOUR / np.sqrt(len(steps))


def test_biases_are_the_known_part_plus_one_that_is_drawn_for_a_run() -> None:
    sensor = SensorErrors(bias=(1.0, 2.0, -3.0), bias_sigma=(0.1, 0.0, 0.3))
    bias = measured(sensor) / PERIOD
    assert np.ptp(bias, axis=1).max() < 1e-12, "constant in a run"
    of_run = bias[:, 0, :]
    assert of_run.mean(axis=0) == pytest.approx([1.0, 2.0, -3.0] * 2, abs=FOUR * 0.3 / np.sqrt(RUNS))
    assert of_run.std(axis=0) == pytest.approx([0.1, 0.0, 0.3] * 2, rel=FOUR / np.sqrt(2.0 * RUNS), abs=1e-12)


def test_a_scale_factor_multiplies_what_the_sensor_feels() -> None:
    true = np.tile([1.0, -2.0, 3.0, 0.0, 5.0, 9.8], (RUNS, 2, 1))
    known = measured(SensorErrors(scale_factor=(1e-3, 0.0, -2e-3)), true)
    assert known[0, 0] == pytest.approx([1.001, -2.0, 2.994, 0.0, 5.0, 9.7804])
    drawn = measured(SensorErrors(scale_factor_sigma=1e-3), true)[:, 0] - true[:, 0]
    assert drawn.std(axis=0) == pytest.approx(1e-3 * np.abs(true[0, 0]), rel=FOUR / np.sqrt(2.0 * RUNS))


@pytest.mark.parametrize("tau", [0.05, 0.3, 100.0])
def test_the_gauss_markov_process_is_stationary_and_forgets_exponentially(tau: float) -> None:
    """E m(t) m(t + s) = sigma^2 exp(-s / tau), from the first sample on."""
    m = measured(SensorErrors(markov_sigma=0.2, markov_time=tau)) / PERIOD
    tolerance = FOUR * np.sqrt(2.0 / (6 * RUNS))
    for lag in (0, 1, 10, COUNT - 1):
        for first in (0, COUNT - 1 - lag):
            together = np.mean(m[:, first] * m[:, first + lag]) / 0.04
            assert together == pytest.approx(np.exp(-lag * PERIOD / tau), abs=tolerance)


def test_the_gauss_markov_recursion_is_the_written_one() -> None:
    noise = np.random.default_rng(2).normal(size=(20, 3))
    found = gauss_markov(noise, 0.5, (1.0, 2.0, 0.0), (3.0, 4.0, 5.0))
    for axis, (sigma, tau) in enumerate([(1.0, 3.0), (2.0, 4.0), (0.0, 5.0)]):
        x, a = sigma * noise[0, axis], np.exp(-0.5 / tau)
        for k in range(20):
            x = x if k == 0 else a * x + sigma * np.sqrt(1.0 - a * a) * noise[k, axis]
            assert found[k, axis] == pytest.approx(x, abs=1e-14)


@given(st.floats(1e-3, 10.0), st.floats(-0.499, 0.499), st.integers(0, 1000))
def test_a_counter_gives_whole_counts_and_its_sum_is_never_a_count_off(
    quantum: float, fraction: float, seed: int
) -> None:
    true = np.random.default_rng(seed).normal(0.3, 2.0, size=(50, 3))
    found = quantised(true, np.full(3, quantum), np.full(3, fraction))
    counts = found / quantum
    assert np.abs(counts - np.round(counts)).max() < 1e-6
    assert np.abs(np.cumsum(found - true, axis=0)).max() <= quantum * (1.0 + 1e-9)


def test_quantisation_is_noise_of_a_twelfth_of_a_count_squared_at_both_ends_of_a_sum_and_no_random_walk() -> None:
    """What is left in the counter at the start and at the end: 1/12 each, after one sample as after fifty."""
    true = np.random.default_rng(7).normal(0.0, 5.0, STILL.shape)
    error = np.cumsum(measured(SensorErrors(quantum=1.0), true) - true, axis=1)
    assert error.var(axis=0) == pytest.approx(np.full((COUNT, 6), 1.0 / 6.0), rel=0.1)


def test_a_quantum_of_one_axis_leaves_the_others() -> None:
    true = np.random.default_rng(3).normal(size=(1, 30, 6))
    found = measured(SensorErrors(quantum=(0.1, 0.0, 0.0)), true)
    assert np.array_equal(found[..., [1, 2, 4, 5]], true[..., [1, 2, 4, 5]])
    assert not np.array_equal(found[..., 0], true[..., 0])


def test_the_truth_handed_over_is_what_was_added() -> None:
    gyro = SensorErrors(bias=0.1, bias_sigma=0.2, markov_sigma=0.3, markov_time=0.5, scale_factor_sigma=0.01)
    accel = SensorErrors(bias_sigma=1.0, scale_factor=0.02)
    true = np.random.default_rng(4).normal(size=(2, 30, 6))
    found, real = apply(true, PERIOD, np.random.default_rng(5), ImuErrors(gyro, accel))
    for columns, sensor in ((slice(0, 3), real.gyro), (slice(3, 6), real.accel)):
        expected = (1.0 + sensor.scale_factor[:, None, :]) * true[..., columns] + sensor.bias * PERIOD
        assert found[..., columns] == pytest.approx(expected, abs=1e-14)
    assert not real.accel.markov.any()
    assert np.ptp(real.gyro.bias, axis=1).min() > 0.0


def test_the_same_seed_gives_the_same_and_a_longer_record_begins_as_the_shorter() -> None:
    sensor = SensorErrors(bias_sigma=1.0, random_walk=1.0, markov_sigma=1.0, markov_time=1.0, quantum=0.01)
    long, again, other = measured(sensor, STILL[0]), measured(sensor, STILL[0]), measured(sensor, STILL[0], seed=2)
    assert np.array_equal(long, again)
    assert not np.array_equal(long, other)
    assert np.array_equal(measured(sensor, STILL[0, :20]), long[:20])


def test_an_error_that_is_switched_off_leaves_the_others_as_they_were() -> None:
    both = SensorErrors(bias_sigma=1.0, random_walk=1.0, markov_sigma=1.0)
    alone = [SensorErrors(bias_sigma=1.0), SensorErrors(random_walk=1.0), SensorErrors(markov_sigma=1.0)]
    assert sum(measured(e, STILL[0]) for e in alone) == pytest.approx(measured(both, STILL[0]), abs=1e-14)
