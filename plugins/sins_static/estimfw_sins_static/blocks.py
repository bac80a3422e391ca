"""The state blocks: velocity error, attitude error, accelerometer bias, gyro bias."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

import numpy as np
from estimfw_inertial.frames import BODY, NAVIGATION
from pydantic import Field

from estimfw.config.types import Settings, Site, non_negative_quantity_vector, quantity_vector
from estimfw.model.frame import Frame
from estimfw.model.parts import BlockParts, DerivedVariable, Output, StateBlock
from estimfw_sins_static.attitude import ATTITUDE_JACOBIAN, attitude_output
from estimfw_sins_static.errors import attitude_error_of, velocity_error_of

__all__ = [
    "AccelBiasConfig",
    "AttitudeErrorConfig",
    "GyroBiasConfig",
    "VelocityErrorConfig",
    "accel_bias",
    "attitude_error",
    "gyro_bias",
    "velocity_error",
]

_Three = tuple[float, float, float]
_SIGMA = "one sigma at the start, for all axes or for each (E, N, U or right, forward, up)"
_MEAN = "expected value at the start, for all axes or for each"


class VelocityErrorConfig(Settings):
    """dV = mechanized velocity minus true velocity, in n."""

    kind: Literal["sins_static.velocity_error"]
    sigma: Annotated[_Three, non_negative_quantity_vector("m/s", 3), Field(description=_SIGMA)]
    mean: Annotated[_Three, quantity_vector("m/s", 3), Field(description=_MEAN)] = (0.0,) * 3


class AttitudeErrorConfig(Settings):
    """phi, the rotation vector with computed C_bn = exp(-[phi x]) C_bn, in n."""

    kind: Literal["sins_static.attitude_error"]
    sigma: Annotated[_Three, non_negative_quantity_vector("rad", 3), Field(description=_SIGMA)]
    mean: Annotated[_Three, quantity_vector("rad", 3), Field(description=_MEAN)] = (0.0,) * 3


class AccelBiasConfig(Settings):
    """Accelerometer bias, measured minus true, constant, in b."""

    kind: Literal["sins_static.accel_bias"]
    sigma: Annotated[_Three, non_negative_quantity_vector("m/s^2", 3), Field(description=_SIGMA)]
    mean: Annotated[_Three, quantity_vector("m/s^2", 3), Field(description=_MEAN)] = (0.0,) * 3


class GyroBiasConfig(Settings):
    """Gyro bias, measured minus true, constant, in b."""

    kind: Literal["sins_static.gyro_bias"]
    sigma: Annotated[_Three, non_negative_quantity_vector("rad/s", 3), Field(description=_SIGMA)]
    mean: Annotated[_Three, quantity_vector("rad/s", 3), Field(description=_MEAN)] = (0.0,) * 3


def _parts(
    block: StateBlock,
    cfg: VelocityErrorConfig | AttitudeErrorConfig | AccelBiasConfig | GyroBiasConfig,
    outputs: tuple[Output, ...] = (),
    derived: tuple[DerivedVariable, ...] = (),
) -> BlockParts:
    covariance = np.diag(np.square(cfg.sigma))
    return BlockParts(
        block,
        tuple(tuple(float(x) for x in row) for row in covariance),
        tuple(float(x) for x in cfg.mean),
        frames=(NAVIGATION, BODY),
        outputs=outputs,
        derived=derived,
    )


def _triad(
    name: str,
    frame: Frame,
    unit: str,
    display: str,
    latex: str,
    *,
    quantity: str,
    truth: str = "",
    truth_error: Callable[..., Any] | None = None,
) -> StateBlock:
    return StateBlock(
        name,
        frame.axes,
        frame.axes,
        unit,
        display,
        frame=frame.name,
        home_frame=frame.name,
        quantity=quantity,
        latex=latex,
        truth=truth,
        truth_error=truth_error,
    )


def velocity_error(name: str, cfg: VelocityErrorConfig, site: Site | None) -> BlockParts:
    """dV in n, m/s."""
    block = _triad(name, NAVIGATION, "m/s", "m/s", r"\delta V", quantity="velocity", truth_error=velocity_error_of)
    return _parts(block, cfg)


def attitude_error(name: str, cfg: AttitudeErrorConfig, site: Site | None) -> BlockParts:
    """phi in n, rad; brings the output ``attitude`` (yaw, pitch, roll, heading) with its Jacobian."""
    block = _triad(name, NAVIGATION, "rad", "deg", r"\phi", quantity="attitude", truth_error=attitude_error_of)
    return _parts(block, cfg, outputs=(attitude_output(name),), derived=(ATTITUDE_JACOBIAN,))


def accel_bias(name: str, cfg: AccelBiasConfig, site: Site | None) -> BlockParts:
    """a in b, m/s^2."""
    return _parts(_triad(name, BODY, "m/s^2", "ug", "a", quantity="accel_bias", truth="accel_bias_b"), cfg)


def gyro_bias(name: str, cfg: GyroBiasConfig, site: Site | None) -> BlockParts:
    """eps in b, rad/s."""
    return _parts(_triad(name, BODY, "rad/s", "deg/h", r"\varepsilon", quantity="gyro_bias", truth="gyro_bias_b"), cfg)
