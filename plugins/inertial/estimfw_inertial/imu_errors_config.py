"""IMU errors as a config says them: a grade, or figures, or a grade with some figures of one's own.

A simulator takes this model as one of its fields, and makes `ImuErrors` of it with `imu_errors`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from estimfw.config.types import (
    Settings,
    non_negative_quantity_vector,
    positive_quantity_vector,
    quantity_vector,
)
from estimfw_inertial.imu_errors import ImuErrors, SensorErrors
from estimfw_inertial.imu_grades import GRADES

__all__ = ["AccelErrorsConfig", "GyroErrorsConfig", "ImuErrorsConfig", "imu_errors"]

_Three = tuple[float, float, float]
_Time = Annotated[_Three, positive_quantity_vector("s", 3, examples=("300 s",))]
_Scale = Annotated[_Three, quantity_vector("1", 3, examples=("100 ppm",))]
_ScaleSigma = Annotated[_Three, non_negative_quantity_vector("1", 3, examples=("100 ppm",))]


class GyroErrorsConfig(Settings):
    """Errors of the gyros, one figure for all axes or one for each; what is left out is that of the grade."""

    bias: Annotated[_Three, quantity_vector("rad/s", 3, examples=("0.01 deg/h",))] | None = None
    bias_sigma: Annotated[_Three, non_negative_quantity_vector("rad/s", 3, examples=("0.01 deg/h",))] | None = None
    random_walk: (
        Annotated[_Three, non_negative_quantity_vector("rad/sqrt(s)", 3, examples=("0.001 deg/sqrt(h)",))] | None
    ) = None
    markov_sigma: Annotated[_Three, non_negative_quantity_vector("rad/s", 3, examples=("0.3 deg/h",))] | None = None
    markov_time: _Time | None = None
    scale_factor: _Scale | None = None
    scale_factor_sigma: _ScaleSigma | None = None
    quantum: Annotated[_Three, non_negative_quantity_vector("rad", 3, examples=("0.1 arcsec",))] | None = None


class AccelErrorsConfig(Settings):
    """Errors of the accelerometers, one figure for all axes or one for each; what is left out is that of the grade."""

    bias: Annotated[_Three, quantity_vector("m/s^2", 3, examples=("100 ug",))] | None = None
    bias_sigma: Annotated[_Three, non_negative_quantity_vector("m/s^2", 3, examples=("100 ug",))] | None = None
    random_walk: (
        Annotated[_Three, non_negative_quantity_vector("m/s/sqrt(s)", 3, examples=("10 ug/sqrt(Hz)",))] | None
    ) = None
    markov_sigma: Annotated[_Three, non_negative_quantity_vector("m/s^2", 3, examples=("50 ug",))] | None = None
    markov_time: _Time | None = None
    scale_factor: _Scale | None = None
    scale_factor_sigma: _ScaleSigma | None = None
    quantum: Annotated[_Three, non_negative_quantity_vector("m/s", 3, examples=("1.2 mm/s",))] | None = None


class ImuErrorsConfig(Settings):
    """``{grade: tactical, gyro: {bias: 0.5 deg/h}}``; without a grade what is left out is zero."""

    grade: Annotated[
        Literal["navigation", "ring_laser", "tactical", "industrial"] | None,
        Field(description="typical errors of a class"),
    ] = None
    gyro: GyroErrorsConfig = GyroErrorsConfig()
    accel: AccelErrorsConfig = AccelErrorsConfig()


def imu_errors(cfg: ImuErrorsConfig) -> ImuErrors:
    """The errors that a config describes."""
    grade = GRADES[cfg.grade] if cfg.grade is not None else ImuErrors()
    return ImuErrors(_overridden(grade.gyro, cfg.gyro), _overridden(grade.accel, cfg.accel))


def _overridden(grade: SensorErrors, own: GyroErrorsConfig | AccelErrorsConfig) -> SensorErrors:
    return replace(grade, **{name: value for name, value in own if value is not None})
