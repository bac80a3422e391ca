"""The integrated velocity against what the attitude says that it should be (15, K3, K4)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from estimfw.config.types import NoiseLevel, Settings, noise, positive_quantity
from estimfw.model.coefficient import constant, matrix, vector
from estimfw.model.parts import Measurement, MeasurementTerm

__all__ = ["IntegratedVelocityConfig", "integrated_velocity"]

ROWS = ("x", "y", "z")


class IntegratedVelocityConfig(Settings):
    """z = alpha - h(A, t); H = H_phi, -J, -M_g, -e_y over the blocks that the config has."""

    kind: Literal["sins_odometer.integrated_velocity"]
    noise: Annotated[NoiseLevel, noise("m/s"), Field(description="of the speed at an update, one sigma")]
    every: Annotated[
        Annotated[float, positive_quantity("s")] | None, Field(description="interval; each step if left out")
    ] = None
    attitude: Annotated[str, Field(description="name of the block of the attitude error")] = "attitude_error"
    gyro_bias: Annotated[str, Field(description="name of the block of the gyro biases")] = "gyro_bias"
    accel_bias: Annotated[str, Field(description="name of the block of the accelerometer biases")] = "accel_bias"
    initial_speed: Annotated[str, Field(description="name of the block of the speed error at the start")] = (
        "initial_speed_error"
    )


def integrated_velocity(name: str, cfg: IntegratedVelocityConfig, context: Any) -> Measurement:
    """Rows along the axes of i; each block is read in the frame in which it was declared."""
    every = (
        MeasurementTerm(cfg.attitude, matrix("attitude_sensitivity"), "attitude"),
        MeasurementTerm(cfg.gyro_bias, -matrix("gyro_sensitivity"), "gyro_bias"),
        MeasurementTerm(cfg.accel_bias, -matrix("accel_sensitivity"), "accel_bias"),
        MeasurementTerm(cfg.initial_speed, constant([0.0, -1.0, 0.0]), "initial_speed"),
    )
    covariance = np.diag(np.square(np.broadcast_to(cfg.noise.value, 3)))
    return Measurement(
        name=name,
        all_rows=ROWS,
        rows=ROWS,
        unit="m/s",
        terms=tuple(term for term in every if term.block in context.blocks),
        covariance=tuple(tuple(float(x) for x in row) for row in covariance),
        noise=cfg.noise.kind,
        innovation=vector("alpha") - vector("predicted"),
        every=cfg.every,
        text="integrated specific-force equation against the attitude (15)",
    )
