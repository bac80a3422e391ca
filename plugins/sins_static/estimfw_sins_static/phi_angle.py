"""The phi-angle error equations, a term at a time (Zhu and Zhang, eq. 2 and 5, corrected: omega_en = 0, f^n = -g^n)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from estimfw_inertial.frames import BODY, NAVIGATION
from pydantic import Field

from estimfw.config.types import Settings, non_negative_quantity_vector
from estimfw.model.coefficient import Coefficient, identity, skew
from estimfw.model.parts import NoiseInput, ProcessParts, ProcessTerm

__all__ = ["PhiAngleConfig", "phi_angle"]


class PhiAngleConfig(Settings):
    """The phi-angle model over the named blocks; terms of blocks that are not there are left out."""

    kind: Literal["sins_static.phi_angle"]
    gyro_noise: Annotated[
        tuple[float, float, float],
        non_negative_quantity_vector("rad/sqrt(s)", 3, examples=("0.001 deg/sqrt(h)",)),
        Field(description="angle random walk, a density, for all axes or for each"),
    ]
    accel_noise: Annotated[
        tuple[float, float, float],
        non_negative_quantity_vector("m/s/sqrt(s)", 3, examples=("10 ug/sqrt(Hz)",)),
        Field(description="velocity random walk, a density, for all axes or for each"),
    ]
    velocity: Annotated[str, Field(description="name of the block of the velocity error")] = "velocity_error"
    attitude: Annotated[str, Field(description="name of the block of the attitude error")] = "attitude_error"
    accel_bias: Annotated[str, Field(description="name of the block of the accelerometer biases")] = "accel_bias"
    gyro_bias: Annotated[str, Field(description="name of the block of the gyro biases")] = "gyro_bias"


def phi_angle(name: str, cfg: PhiAngleConfig, context: Any) -> ProcessParts:
    """Terms acting in n; noises in b. ``context.blocks`` are the blocks that the config has."""
    V, phi, a, eps = cfg.velocity, cfg.attitude, cfg.accel_bias, cfg.gyro_bias
    every = (
        _term("coriolis", V, V, -2.0 * skew("earth_rate_n"), "-2 omega_ie x dV (eq. 2)"),
        _term("gravity_tilt", V, phi, skew("f_n"), "f_n x phi (eq. 2)"),
        _term("accel_bias_coupling", V, a, identity(3), "+a (eq. 2)"),
        _term("accel_noise_coupling", V, "accel_noise", identity(3), "+eta_a (eq. 2)"),
        _term("earth_rate", phi, phi, -skew("earth_rate_n"), "-omega_ie x phi (eq. 5)"),
        _term("gyro_bias_coupling", phi, eps, -identity(3), "-eps (eq. 5)"),
        _term("gyro_noise_coupling", phi, "gyro_noise", -identity(3), "-eta_e (eq. 5)"),
    )
    noises = (_noise("accel_noise", cfg.accel_noise, "m/s^2"), _noise("gyro_noise", cfg.gyro_noise, "rad/s"))
    known = {*context.blocks, "accel_noise", "gyro_noise"}
    terms = tuple(t for t in every if t.target in known and t.source in known)
    driving = {t.source for t in terms}
    return ProcessParts(terms, tuple(n for n in noises if n.name in driving), frames=(NAVIGATION, BODY))


def _term(label: str, target: str, source: str, coefficient: Coefficient, text: str) -> ProcessTerm:
    return ProcessTerm(label, target, source, coefficient, frame="n", text=text)


def _noise(name: str, density: tuple[float, ...], unit: str) -> NoiseInput:
    psd = tuple(float(x) for x in np.square(density))
    return NoiseInput(name, BODY.axes, BODY.axes, psd, unit, frame="b")
