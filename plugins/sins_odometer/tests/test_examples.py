"""The four methods as ordinary configs, from pulses and increments to an attitude."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimfw.run.run import run_problem


@pytest.mark.parametrize(
    ("name", "yaw", "level"),
    [
        ("odometer_aeba.yaml", 0.3, 0.006),
        ("odometer_aeba_raw.yaml", 1.2, 0.03),
        ("odometer_adba.yaml", 0.6, 0.02),
        ("odometer_adba_raw.yaml", 8.0, 0.1),
    ],
)
def test_an_example_aligns_to_three_times_its_rms_of_many_drives(
    opened: Any, name: str, yaw: float, level: float
) -> None:
    done = run_problem(opened(name))
    assert done.output_error is not None
    error = np.abs(np.degrees(done.output_error[-1, :3]))
    assert error[0] < yaw and np.max(error[1:]) < level


def test_the_low_pass_of_the_config_leaves_seven_centimetres_a_second(opened: Any) -> None:
    """Raw 1.6 m/s rms, filtered 0.07 m/s, on the stamps of the IMU: its delay is compensated."""
    problem = opened("odometer_aeba.yaml")
    done = run_problem(problem)
    stream = done.prepared.record.streams["imu"]
    truth = done.prepared.record.truth
    assert truth is not None
    speed = truth.values["speed"][np.searchsorted(truth.time, stream.time - 1e-9)]
    error = stream.values[:, stream.columns.index("speed")] - speed
    assert 0.03 < np.sqrt(np.mean(np.square(error))) < 0.15
    early, late = (np.roll(speed, k) - speed for k in (-200, 200))
    assert abs(np.mean(error * early)) < 0.02 * np.mean(early**2), "no part of it is a shift"
    assert abs(np.mean(error * late)) < 0.02 * np.mean(late**2)


def test_nothing_is_said_to_be_undetermined_before_anything_is_measured(opened: Any) -> None:
    """At the start the measurement reads nothing yet; along the drive it does."""
    assert opened("odometer_aeba.yaml").undetermined == ()
