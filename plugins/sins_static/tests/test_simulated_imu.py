"""A simulated base with an IMU of a grade: errors reach the record, the truth knows them, and the filter finds them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from estimfw.errors import EstimfwError

DEGREE = np.pi / 180.0
MICRO_G = 9.80665e-6


def imu_of(record: Any) -> Any:
    return record.streams["imu"].values


def test_the_four_short_fields_are_the_long_ones(composed: Callable[..., Any]) -> None:
    short = ("source.gyro_bias=[1 deg/h, 2 deg/h, 3 deg/h]", "source.accel_bias=50 ug",
             "source.gyro_noise=0.01 deg/sqrt(h)", "source.accel_noise=20 ug/sqrt(Hz)")  # fmt: skip
    long = (
        "source.imu={gyro: {bias: [1 deg/h, 2 deg/h, 3 deg/h], random_walk: 0.01 deg/sqrt(h)}, "
        "accel: {bias: 50 ug, random_walk: 20 ug/sqrt(Hz)}}"
    )
    one, other = composed("static_12", *short).source.load(), composed("static_12", long).source.load()
    np.testing.assert_array_equal(imu_of(one), imu_of(other))
    for name in ("gyro_bias_b", "accel_bias_b"):
        np.testing.assert_array_equal(one.truth.values[name], other.truth.values[name])


def test_a_grade_draws_its_biases_anew_for_each_seed_and_the_truth_knows_them(composed: Callable[..., Any]) -> None:
    free = (
        "source.imu={grade: navigation, gyro: {scale_factor_sigma: 0}, accel: {scale_factor_sigma: 0}}",
        "source.noise=false",
    )
    clean = composed("static_12", "source.imu={}", "source.noise=false", "source.duration=1 s").source.load()
    biases = []
    for seed in range(100):
        record = composed("static_12", *free, f"source.seed={seed}", "source.duration=1 s").source.load()
        bias = np.concatenate([record.truth.values[name][0] for name in ("gyro_bias_b", "accel_bias_b")])
        np.testing.assert_allclose(imu_of(record)[0] - imu_of(clean)[0], bias, atol=1e-14)
        biases.append(bias)
    expected = [0.01 * DEGREE / 3600.0] * 3 + [50.0 * MICRO_G] * 3
    np.testing.assert_allclose(np.std(biases, axis=0), expected, rtol=4.0 / np.sqrt(200.0))


def test_a_slow_drift_is_in_the_truth_along_the_run(composed: Callable[..., Any]) -> None:
    drift = "source.imu={gyro: {markov_sigma: 1 deg/h, markov_time: 100 s}}"
    record = composed("static_12", drift, "source.noise=false").source.load()
    clean = composed("static_12", "source.imu={}", "source.noise=false").source.load()
    bias = record.truth.values["gyro_bias_b"]
    np.testing.assert_allclose(imu_of(record)[:, :3] - imu_of(clean)[:, :3], bias, atol=1e-16)
    assert np.all(np.ptp(bias, axis=0) > 0.5 * DEGREE / 3600.0)


def test_noise_false_leaves_biases_and_counts(composed: Callable[..., Any]) -> None:
    ring_laser = ("source.imu={grade: ring_laser}", "source.noise=false")
    record = composed("static_12", *ring_laser).source.load()
    counts = imu_of(record)[:, 3:] / (125e-6 * 9.780327)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    assert np.all(record.truth.values["gyro_bias_b"] != 0.0)


def test_a_filter_told_of_the_grade_is_right_about_a_ring_laser_unit(ran: Callable[..., Any]) -> None:
    """Within 4 sigma for every state, over some seeds, with the quantisation that no model has."""
    grade = (
        "source.imu={grade: ring_laser}", "blocks.gyro_bias.sigma=0.03 deg/h", "source.misalignment=0.01 deg",
        "source.duration=100 s", "estimator.kernel=numba",
    )  # fmt: skip
    for seed in range(5):
        done = ran("static_12", *grade, f"source.seed={seed}")
        error = done.estimate[-1] - done.truth[-1]
        assert np.all(np.abs(error) < 4.0 * done.sigma[-1])


@pytest.mark.parametrize(
    "field", ["gyro_bias=1 deg/h", "accel_bias=1 ug", "gyro_noise=1 deg/sqrt(h)", "accel_noise=1 ug/sqrt(Hz)"]
)
def test_saying_the_same_twice_is_refused(composed: Callable[..., Any], field: str) -> None:
    name = field.split("=")[0]
    with pytest.raises(EstimfwError, match=f"has `imu` and `{name}`, which say the same") as caught:
        composed("static_12", "source.imu={grade: tactical}", f"source.{field}")
    assert f"move `{name}` into `imu`" in str(caught.value.hint)


def test_a_grade_that_is_none_names_those_that_are(composed: Callable[..., Any]) -> None:
    with pytest.raises(EstimfwError, match="grade") as caught:
        composed("static_12", "source.imu={grade: tactcal}")
    assert "tactical" in str(caught.value)
