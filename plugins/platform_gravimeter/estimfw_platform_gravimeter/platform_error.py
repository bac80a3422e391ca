"""The error equations of a levelled platform on a standing base, a term at a time (Yang et al. 2014, derived anew)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from estimfw.config.types import Settings, non_negative_quantity
from estimfw.model.coefficient import Coefficient, constant, identity, scalar, skew
from estimfw.model.parts import NoiseInput, ProcessParts, ProcessTerm
from estimfw_platform_gravimeter.frames import NAVIGATION, PLATFORM

__all__ = ["PlatformErrorConfig", "platform_error"]

#: What a velocity error (E, N, U) does to the commanded rate: level, times 1 / R; and in azimuth, times tan L / R.
_LEVEL = constant([[0, -1, 0], [1, 0, 0], [0, 0, 0]])
_AZIMUTH = constant([[0, 0, 0], [0, 0, 0], [1, 0, 0]])


class PlatformErrorConfig(Settings):
    """The error model over the named blocks; terms of blocks that are not there are left out, one named here must be there."""

    kind: Literal["platform_gravimeter.platform_error"]
    gyro_noise: Annotated[
        float,
        non_negative_quantity("rad/sqrt(s)", examples=("0.001 deg/sqrt(h)",)),
        Field(description="angle random walk of each gyro, a density"),
    ]
    accel_noise: Annotated[
        float,
        non_negative_quantity("m/s/sqrt(s)", examples=("5 ug/sqrt(Hz)",)),
        Field(description="velocity random walk of each accelerometer, a density"),
    ]
    velocity: Annotated[str, Field(description="name of the block of the velocity error")] = "velocity_error"
    attitude: Annotated[str, Field(description="name of the block of the platform's attitude error")] = "attitude_error"
    accel_bias: Annotated[str, Field(description="name of the block of the accelerometer biases")] = "accel_bias"
    gyro_drift: Annotated[str, Field(description="name of the block of the gyro drifts")] = "gyro_drift"


def platform_error(name: str, cfg: PlatformErrorConfig, context: Any) -> ProcessParts:
    """Terms acting in n; noises in p. ``context.blocks`` are the blocks that the config has.

    Raises
    ------
    ConfigError
        A block is named here that the config does not have.
    """
    for role in cfg.model_fields_set & {"velocity", "attitude", "accel_bias", "gyro_drift"}:
        context.block(getattr(cfg, role))
    V, phi, dA, eps = cfg.velocity, cfg.attitude, cfg.accel_bias, cfg.gyro_drift
    transport, azimuth = scalar("curvature") * _LEVEL, scalar("curvature") * scalar("tan_latitude") * _AZIMUTH
    every = (
        _term("coriolis", V, V, -2.0 * skew("earth_rate_n"), "-2 omega_ie x dV"),
        _term("gravity_tilt", V, phi, scalar("gravity") * skew((0.0, 0.0, 1.0)), "f_n x phi, f_n = (0, 0, g)"),
        _term("accel_bias_coupling", V, dA, identity(3), "+dA, turned by alpha"),
        _term("accel_noise_coupling", V, "accel_noise", identity(3), "+eta_a"),
        _term("earth_rate", phi, phi, -skew("earth_rate_n"), "-omega_ie x phi"),
        _term("transport", phi, V, transport, "(-dV_N, dV_E) / R: the commanded rate over the Earth"),
        _term("azimuth_transport", phi, V, azimuth, "tan L dV_E / R"),
        _term("gyro_drift_coupling", phi, eps, identity(3), "+eps, turned by alpha"),
        _term("gyro_noise_coupling", phi, "gyro_noise", identity(3), "+eta_g"),
    )
    noises = (_noise("accel_noise", cfg.accel_noise, "m/s^2"), _noise("gyro_noise", cfg.gyro_noise, "rad/s"))
    known = {*context.blocks, "accel_noise", "gyro_noise"}
    terms = tuple(t for t in every if t.target in known and t.source in known)
    driving = {t.source for t in terms}
    return ProcessParts(terms, tuple(n for n in noises if n.name in driving), frames=(NAVIGATION, PLATFORM))


def _term(label: str, target: str, source: str, coefficient: Coefficient, text: str) -> ProcessTerm:
    return ProcessTerm(label, target, source, coefficient, frame="n", text=text)


def _noise(name: str, density: float, unit: str) -> NoiseInput:
    """A full triad, so that it does not matter how the platform is turned; what it has in the vertical drives no state."""
    psd = float(np.square(density))
    return NoiseInput(name, PLATFORM.axes, PLATFORM.axes, (psd,) * 3, unit, frame="p")
