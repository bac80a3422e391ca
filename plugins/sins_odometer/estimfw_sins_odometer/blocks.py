"""The state blocks: attitude error in i, gyro and accelerometer bias in b, error of the speed at the start."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from estimfw.config.types import (
    Settings,
    Site,
    non_negative_quantity,
    non_negative_quantity_vector,
    quantity,
    quantity_vector,
)
from estimfw.model.frame import Frame
from estimfw.model.parts import BlockParts, StateBlock
from estimfw_sins_odometer.attitude import ATTITUDE_JACOBIAN, attitude_output
from estimfw_sins_odometer.errors import attitude_error_of
from estimfw_sins_odometer.frames import BODY, INERTIAL, NAVIGATION

__all__ = [
    "AccelBiasConfig",
    "AttitudeErrorConfig",
    "GyroBiasConfig",
    "InitialSpeedErrorConfig",
    "accel_bias",
    "attitude_error",
    "gyro_bias",
    "initial_speed_error",
]

_Three = tuple[float, float, float]
_SIGMA = "one sigma at the start, for all axes or for each"
_MEAN = "expected value at the start, for all axes or for each"


class AttitudeErrorConfig(Settings):
    """phi, the rotation vector with true C_ni = exp([phi x]) C_ni, in i; a start that was levelled brings its own covariance."""

    kind: Literal["sins_odometer.attitude_error"]
    sigma: Annotated[_Three, non_negative_quantity_vector("rad", 3), Field(description=_SIGMA)]
    gyro_bias: Annotated[str, Field(description="name of the block of the gyro biases")] = "gyro_bias"


class GyroBiasConfig(Settings):
    """Gyro bias, measured minus true, constant, in b."""

    kind: Literal["sins_odometer.gyro_bias"]
    sigma: Annotated[_Three, non_negative_quantity_vector("rad/s", 3), Field(description=_SIGMA)]
    mean: Annotated[_Three, quantity_vector("rad/s", 3), Field(description=_MEAN)] = (0.0,) * 3


class AccelBiasConfig(Settings):
    """Accelerometer bias, measured minus true, constant, in b."""

    kind: Literal["sins_odometer.accel_bias"]
    sigma: Annotated[_Three, non_negative_quantity_vector("m/s^2", 3), Field(description=_SIGMA)]
    mean: Annotated[_Three, quantity_vector("m/s^2", 3), Field(description=_MEAN)] = (0.0,) * 3


class InitialSpeedErrorConfig(Settings):
    """Error of the odometer's speed at the start, measured minus true: that one reading is in every measurement."""

    kind: Literal["sins_odometer.initial_speed_error"]
    sigma: Annotated[float, non_negative_quantity("m/s"), Field(description="one sigma of that reading")]
    mean: Annotated[float, quantity("m/s"), Field(description="expected value")] = 0.0


def attitude_error(name: str, cfg: AttitudeErrorConfig, site: Site | None) -> BlockParts:
    """phi in i, rad; brings the output ``attitude`` (yaw, pitch, roll, heading) with its Jacobian."""
    block = StateBlock(
        name, INERTIAL.axes, INERTIAL.axes, "rad", "deg", frame="i", home_frame="i",
        quantity="attitude", latex=r"\phi", truth_error=attitude_error_of,
    )  # fmt: skip
    return BlockParts(
        block,
        _diagonal(cfg.sigma),
        (0.0,) * 3,
        frames=(INERTIAL, NAVIGATION, BODY),
        outputs=(attitude_output(name, cfg.gyro_bias),),
        derived=(ATTITUDE_JACOBIAN,),
    )


def gyro_bias(name: str, cfg: GyroBiasConfig, site: Site | None) -> BlockParts:
    """eps in b, rad/s."""
    block = _triad(name, BODY, "rad/s", "deg/h", r"\varepsilon", "gyro_bias")
    return BlockParts(block, _diagonal(cfg.sigma), cfg.mean, frames=(INERTIAL, BODY))


def accel_bias(name: str, cfg: AccelBiasConfig, site: Site | None) -> BlockParts:
    """The accelerometer bias in b, m/s^2."""
    block = _triad(name, BODY, "m/s^2", "ug", r"\nabla", "accel_bias")
    return BlockParts(block, _diagonal(cfg.sigma), cfg.mean, frames=(INERTIAL, BODY))


def initial_speed_error(name: str, cfg: InitialSpeedErrorConfig, site: Site | None) -> BlockParts:
    """The error of v(0), m/s, constant."""
    block = StateBlock(name, ("",), ("",), "m/s", "m/s", quantity="initial_speed", latex=r"\delta v_0")
    return BlockParts(block, ((cfg.sigma**2,),), (cfg.mean,))


def _triad(name: str, frame: Frame, unit: str, display: str, latex: str, quantity: str) -> StateBlock:
    return StateBlock(
        name, frame.axes, frame.axes, unit, display, frame=frame.name, home_frame=frame.name,
        quantity=quantity, latex=latex, truth=f"{quantity}_b",
    )  # fmt: skip


def _diagonal(sigma: ArrayLike) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(x) for x in row) for row in np.diag(np.square(sigma)))
