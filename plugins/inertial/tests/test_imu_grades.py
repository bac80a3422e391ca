"""The presets: figures in the units in which data sheets give them, and what an alignment makes of them."""

from __future__ import annotations

import numpy as np
import pytest
from estimfw_inertial.imu_errors import apply
from estimfw_inertial.imu_grades import GRADES

DEG, UG = np.pi / 180.0, 9.80665e-6


def test_the_ring_laser_is_what_the_public_record_says_of_its_unit() -> None:
    gyro, accel = GRADES["ring_laser"].gyro, GRADES["ring_laser"].accel
    assert gyro.bias_sigma == pytest.approx(0.03 * DEG / 3600.0)
    assert gyro.random_walk == pytest.approx(0.001 * DEG / 60.0)
    assert gyro.quantum == pytest.approx(0.1 * DEG / 3600.0)
    assert accel.bias_sigma == pytest.approx(100.0 * UG)
    assert accel.random_walk == pytest.approx(10.0 * UG)
    assert accel.quantum == pytest.approx(1.22e-3, rel=0.005)


@pytest.mark.parametrize("sensor", ["gyro", "accel"])
@pytest.mark.parametrize("field", ["bias_sigma", "random_walk", "scale_factor_sigma", "markov_sigma"])
def test_from_navigation_to_industrial_nothing_gets_better(sensor: str, field: str) -> None:
    order = [getattr(getattr(GRADES[name], sensor), field) for name in ("navigation", "tactical", "industrial")]
    assert order == sorted(order)


def test_a_grade_is_centred_on_nothing() -> None:
    """Its biases and scale factors are drawn for a run: no preset favours a sign."""
    for errors in GRADES.values():
        for sensor in (errors.gyro, errors.accel):
            assert sensor.bias == sensor.scale_factor == 0.0


def test_a_ring_laser_at_rest_looks_like_the_public_record() -> None:
    """Whole counts of 0.1 arcsec and 125 ug s; over a minute the Earth's rate to 0.1 deg/h and gravity to 400 ug."""
    rate, g, count = 7.292115e-5 * np.cos(0.6), 9.797, 6000
    true = np.tile(np.array([0.0, rate, 0.0, 0.0, 0.0, g]) * 0.01, (count, 1))
    found, _ = apply(true, 0.01, np.random.default_rng(1), GRADES["ring_laser"])
    for columns, quantum in ((slice(0, 3), 0.1 * DEG / 3600.0), (slice(3, 6), 125e-6 * 9.780327)):
        counts = found[:, columns] / quantum
        assert np.abs(counts - np.round(counts)).max() < 1e-6
    mean = found.mean(axis=0) / 0.01
    assert mean[:3] == pytest.approx([0.0, rate, 0.0], abs=0.1 * DEG / 3600.0)
    assert mean[3:] == pytest.approx([0.0, 0.0, g], abs=400.0 * UG)
