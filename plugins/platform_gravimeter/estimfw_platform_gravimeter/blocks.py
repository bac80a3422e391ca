"""The state blocks: velocity error, attitude error of the platform, accelerometer biases, gyro drifts."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from estimfw.config.types import Settings, Site, non_negative_quantity_vector, quantity_vector
from estimfw.model.frame import Frame
from estimfw.model.parts import BlockParts, StateBlock
from estimfw_platform_gravimeter.angles import PLATFORM_JACOBIAN, platform_output
from estimfw_platform_gravimeter.frames import NAVIGATION, PLATFORM

__all__ = [
    "AccelBiasConfig",
    "AttitudeErrorConfig",
    "GyroDriftConfig",
    "VelocityErrorConfig",
    "accel_bias",
    "attitude_error",
    "gyro_drift",
    "velocity_error",
]

_Two = tuple[float, float]
_Three = tuple[float, float, float]
_SIGMA = "one sigma at the start, for all axes or for each"
_MEAN = "expected value at the start, for all axes or for each"


class VelocityErrorConfig(Settings):
    """dV = computed velocity minus true, East and North."""

    kind: Literal["platform_gravimeter.velocity_error"]
    sigma: Annotated[_Two, non_negative_quantity_vector("m/s", 2), Field(description=f"{_SIGMA} (E, N)")]
    mean: Annotated[_Two, quantity_vector("m/s", 2), Field(description=f"{_MEAN} (E, N)")] = (0.0,) * 2


class AttitudeErrorConfig(Settings):
    """phi, the rotation vector from the computed platform to the real one, in n: two tilts and the azimuth error."""

    kind: Literal["platform_gravimeter.attitude_error"]
    sigma: Annotated[_Three, non_negative_quantity_vector("rad", 3), Field(description=f"{_SIGMA} (E, N, U)")]
    mean: Annotated[_Three, quantity_vector("rad", 3), Field(description=f"{_MEAN} (E, N, U)")] = (0.0,) * 3


class AccelBiasConfig(Settings):
    """dA, measured minus true specific force, constant, of the accelerometers x and y of the platform."""

    kind: Literal["platform_gravimeter.accel_bias"]
    sigma: Annotated[_Two, non_negative_quantity_vector("m/s^2", 2), Field(description=f"{_SIGMA} (x, y)")]
    mean: Annotated[_Two, quantity_vector("m/s^2", 2), Field(description=f"{_MEAN} (x, y)")] = (0.0,) * 2


class GyroDriftConfig(Settings):
    """eps, the rate at which the platform turns minus the commanded one, constant, about its axes."""

    kind: Literal["platform_gravimeter.gyro_drift"]
    sigma: Annotated[_Three, non_negative_quantity_vector("rad/s", 3), Field(description=f"{_SIGMA} (x, y, z)")]
    mean: Annotated[_Three, quantity_vector("rad/s", 3), Field(description=f"{_MEAN} (x, y, z)")] = (0.0,) * 3


_Config = VelocityErrorConfig | AttitudeErrorConfig | AccelBiasConfig | GyroDriftConfig


def velocity_error(name: str, cfg: VelocityErrorConfig, site: Site | None) -> BlockParts:
    """dV in n, m/s; no vertical velocity is computed."""
    return _parts(_block(name, NAVIGATION, 2, ("m/s", "m/s"), "velocity", r"\delta V", "velocity_error_n"), cfg)


def attitude_error(name: str, cfg: AttitudeErrorConfig, site: Site | None) -> BlockParts:
    """phi in n, rad; brings the output ``platform`` (azimuth, tilt_x, tilt_y) with its Jacobian."""
    parts = _parts(_block(name, NAVIGATION, 3, ("rad", "arcmin"), "attitude", r"\phi", "attitude_error_n"), cfg)
    return replace(parts, outputs=(platform_output(name),), derived=(PLATFORM_JACOBIAN,))


def accel_bias(name: str, cfg: AccelBiasConfig, site: Site | None) -> BlockParts:
    """dA in p, m/s^2; the vertical accelerometer is the gravity sensor."""
    return _parts(_block(name, PLATFORM, 2, ("m/s^2", "ug"), "accel_bias", r"\Delta A", "accel_bias_p"), cfg)


def gyro_drift(name: str, cfg: GyroDriftConfig, site: Site | None) -> BlockParts:
    """eps in p, rad/s."""
    return _parts(_block(name, PLATFORM, 3, ("rad/s", "deg/h"), "gyro_drift", r"\varepsilon", "gyro_drift_p"), cfg)


def _block(
    name: str, frame: Frame, live: int, units: tuple[str, str], quantity: str, latex: str, truth: str
) -> StateBlock:
    """The first ``live`` axes of a triad; ``units`` are SI and what people read."""
    return StateBlock(
        name, frame.axes, frame.axes[:live], *units, frame.name, frame.name, quantity=quantity, latex=latex, truth=truth
    )


def _parts(block: StateBlock, cfg: _Config) -> BlockParts:
    """Over all axes of the frame; of those that are no states it is nothing."""
    sigma, mean = (np.zeros(len(block.all_axes)) for _ in range(2))
    sigma[list(block.live)], mean[list(block.live)] = cfg.sigma, cfg.mean
    rows = tuple(tuple(float(x) for x in row) for row in np.diag(np.square(sigma)))
    return BlockParts(block, rows, tuple(float(x) for x in mean), frames=(NAVIGATION, PLATFORM))
