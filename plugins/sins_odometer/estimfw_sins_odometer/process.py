"""How the attitude error moves: the transport rate is made of the odometer's speed in a wrong attitude, and of its noise (K2)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from estimfw.config.types import Settings, non_negative_quantity
from estimfw.model.coefficient import identity, matrix, vector
from estimfw.model.parts import NoiseInput, ProcessParts, ProcessTerm
from estimfw_sins_odometer.frames import BODY, INERTIAL, NAVIGATION

__all__ = ["PhiIConfig", "phi_i"]


class PhiIConfig(Settings):
    """phi' = A F_c A^T (r x phi) + gyro noise + A F_c A^T C_bi e_y (noise of the speed)."""

    kind: Literal["sins_odometer.phi_i"]
    gyro_noise: Annotated[
        float,
        non_negative_quantity("rad/sqrt(s)", examples=("0.003 deg/sqrt(h)",)),
        Field(description="angle random walk, a density"),
    ]
    speed_noise: Annotated[
        float,
        non_negative_quantity("m/s/sqrt(Hz)", examples=("0.2 m/s/sqrt(Hz)",)),
        Field(description="of the speed, a density: its deviation times the root of the time between readings"),
    ] = 0.0
    attitude: Annotated[str, Field(description="name of the block of the attitude error")] = "attitude_error"


def phi_i(name: str, cfg: PhiIConfig, context: Any) -> ProcessParts:
    """Terms acting in i."""
    phi = cfg.attitude
    terms = (
        ProcessTerm(
            "transport_rate", phi, phi, matrix("transport_coupling"), frame="i",
            text="A F_c A^T [r x] phi: the speed is taken to n by a wrong attitude (K2)",
        ),
        ProcessTerm("gyro_noise_coupling", phi, "gyro_noise", identity(3), frame="i", text="angle random walk (K2)"),
        ProcessTerm(
            "speed_noise_coupling", phi, "speed_noise", vector("speed_coupling"), frame="i",
            text="the noise of the speed in the transport rate (K2)",
        ),
    )  # fmt: skip
    noises = (
        NoiseInput("gyro_noise", INERTIAL.axes, INERTIAL.axes, (cfg.gyro_noise**2,) * 3, "rad/s", frame="i"),
        NoiseInput("speed_noise", ("",), ("",), (cfg.speed_noise**2,), "m/s"),
    )
    driven = terms if cfg.speed_noise else terms[:2]
    return ProcessParts(driven, noises if cfg.speed_noise else noises[:1], frames=(INERTIAL, NAVIGATION, BODY))
