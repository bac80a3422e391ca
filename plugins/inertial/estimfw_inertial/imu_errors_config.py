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


class GyroErrorsConfig(Settings):
    """Errors of the gyros, one figure for all axes or one for each; what is left out is that of the grade."""

    bias: Annotated[
        Annotated[_Three, quantity_vector("rad/s", 3, examples=("0.01 deg/h",))] | None,
        Field(description="a known bias, measured minus true"),
    ] = None
    bias_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("rad/s", 3, examples=("0.01 deg/h",))] | None,
        Field(description="one sigma of a bias that is drawn for each run"),
    ] = None
    random_walk: Annotated[
        Annotated[_Three, non_negative_quantity_vector("rad/sqrt(s)", 3, examples=("0.001 deg/sqrt(h)",))] | None,
        Field(description="white noise, a density"),
    ] = None
    markov_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("rad/s", 3, examples=("0.3 deg/h",))] | None,
        Field(description="one sigma of a drift of the bias (first-order Gauss-Markov)"),
    ] = None
    markov_time: Annotated[
        Annotated[_Three, positive_quantity_vector("s", 3, examples=("300 s",))] | None,
        Field(description="correlation time of that drift"),
    ] = None
    scale_factor: Annotated[
        Annotated[_Three, quantity_vector("1", 3, examples=("100 ppm",))] | None,
        Field(description="a known error of the scale factor"),
    ] = None
    scale_factor_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("1", 3, examples=("100 ppm",))] | None,
        Field(description="one sigma of one that is drawn for each run"),
    ] = None
    quantum: Annotated[
        Annotated[_Three, non_negative_quantity_vector("rad", 3, examples=("0.1 arcsec",))] | None,
        Field(description="resolution of an increment; 0: none"),
    ] = None


class AccelErrorsConfig(Settings):
    """Errors of the accelerometers, one figure for all axes or one for each; what is left out is that of the grade."""

    bias: Annotated[
        Annotated[_Three, quantity_vector("m/s^2", 3, examples=("100 ug",))] | None,
        Field(description="a known bias, measured minus true"),
    ] = None
    bias_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("m/s^2", 3, examples=("100 ug",))] | None,
        Field(description="one sigma of a bias that is drawn for each run"),
    ] = None
    random_walk: Annotated[
        Annotated[_Three, non_negative_quantity_vector("m/s/sqrt(s)", 3, examples=("10 ug/sqrt(Hz)",))] | None,
        Field(description="white noise, a density"),
    ] = None
    markov_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("m/s^2", 3, examples=("50 ug",))] | None,
        Field(description="one sigma of a drift of the bias (first-order Gauss-Markov)"),
    ] = None
    markov_time: Annotated[
        Annotated[_Three, positive_quantity_vector("s", 3, examples=("300 s",))] | None,
        Field(description="correlation time of that drift"),
    ] = None
    scale_factor: Annotated[
        Annotated[_Three, quantity_vector("1", 3, examples=("100 ppm",))] | None,
        Field(description="a known error of the scale factor"),
    ] = None
    scale_factor_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("1", 3, examples=("100 ppm",))] | None,
        Field(description="one sigma of one that is drawn for each run"),
    ] = None
    quantum: Annotated[
        Annotated[_Three, non_negative_quantity_vector("m/s", 3, examples=("1.2 mm/s",))] | None,
        Field(description="resolution of an increment; 0: none"),
    ] = None


class ImuErrorsConfig(Settings):
    """``{grade: tactical, gyro: {bias: 0.5 deg/h}}``; without a grade what is left out is zero."""

    grade: Annotated[
        Literal["navigation", "ring_laser", "tactical", "industrial"] | None,
        Field(description="typical errors of a class"),
    ] = None
    gyro: Annotated[GyroErrorsConfig, Field(description="in place of the grade's")] = GyroErrorsConfig()
    accel: Annotated[AccelErrorsConfig, Field(description="in place of the grade's")] = AccelErrorsConfig()


def imu_errors(cfg: ImuErrorsConfig) -> ImuErrors:
    """The errors that a config describes."""
    grade = GRADES[cfg.grade] if cfg.grade is not None else ImuErrors()
    return ImuErrors(_overridden(grade.gyro, cfg.gyro), _overridden(grade.accel, cfg.accel))


def _overridden(grade: SensorErrors, own: GyroErrorsConfig | AccelErrorsConfig) -> SensorErrors:
    return replace(grade, **{name: value for name, value in own if value is not None})
