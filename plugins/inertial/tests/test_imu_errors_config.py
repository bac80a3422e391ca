"""IMU errors in a config: a grade, figures with units, or both."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, get_args

import numpy as np
import pytest
from estimfw_inertial.imu_errors import ImuErrors, SensorErrors
from estimfw_inertial.imu_errors_config import AccelErrorsConfig, GyroErrorsConfig, ImuErrorsConfig, imu_errors
from estimfw_inertial.imu_grades import GRADES
from pydantic import ValidationError

DEG, UG = np.pi / 180.0, 9.80665e-6


def errors(**config: Any) -> ImuErrors:
    return imu_errors(ImuErrorsConfig.model_validate(config))


def test_nothing_said_is_no_error() -> None:
    assert errors() == ImuErrors()


@pytest.mark.parametrize("name", sorted(GRADES))
def test_a_grade_is_its_preset(name: str) -> None:
    assert errors(grade=name) == GRADES[name]


def test_every_preset_can_be_named() -> None:
    annotation = ImuErrorsConfig.model_fields["grade"].annotation
    named = {name for part in get_args(annotation) for name in get_args(part)}
    assert named == set(GRADES)


@pytest.mark.parametrize("config", [GyroErrorsConfig, AccelErrorsConfig])
def test_every_error_can_be_set(config: type[GyroErrorsConfig] | type[AccelErrorsConfig]) -> None:
    assert set(config.model_fields) == {f.name for f in fields(SensorErrors)}


def test_figures_of_ones_own_replace_those_of_the_grade_and_leave_the_rest() -> None:
    found = errors(
        grade="tactical", gyro={"bias_sigma": "0.5 deg/h"}, accel={"quantum": "1 mm/s", "scale_factor": "50 ppm"}
    )
    assert found.gyro.bias_sigma == pytest.approx((0.5 * DEG / 3600.0,) * 3)
    assert found.gyro.random_walk == GRADES["tactical"].gyro.random_walk
    assert found.accel.quantum == pytest.approx((1e-3,) * 3)
    assert found.accel.scale_factor == pytest.approx((50e-6,) * 3)
    assert found.accel.bias_sigma == GRADES["tactical"].accel.bias_sigma


def test_figures_alone_may_differ_by_axis() -> None:
    found = errors(accel={"bias": ["100 ug", "-80 ug", "0 ug"], "random_walk": "10 ug/sqrt(Hz)"})
    assert found.accel.bias == pytest.approx((100.0 * UG, -80.0 * UG, 0.0))
    assert found.accel.random_walk == pytest.approx((10.0 * UG,) * 3)
    assert found.gyro == SensorErrors()


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"grade": "excellent"}, "navigation"),
        ({"gyro": {"bias": "100 ug"}}, "not in rad/s"),
        ({"gyro": {"bias_sigma": "-1 deg/h"}}, "must be zero or more"),
        ({"accel": {"markov_time": "0 s"}}, "positive"),
        ({"accel": {"bais": "100 ug"}}, "bais"),
    ],
)
def test_what_makes_no_sense_is_refused(config: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        errors(**config)
