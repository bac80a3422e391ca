"""The base stands: the velocity that the platform computes is its own error."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from estimfw.config.types import NoiseLevel, Settings, noise
from estimfw.model.coefficient import identity
from estimfw.model.parts import Measurement, MeasurementTerm
from estimfw_platform_gravimeter.frames import NAVIGATION

__all__ = ["VelocityConfig", "velocity"]


class VelocityConfig(Settings):
    """z = computed velocity, East and North, of a platform on a standing base."""

    kind: Literal["platform_gravimeter.velocity"]
    noise: Annotated[
        NoiseLevel, noise("m/s"), Field(description="per measurement (0.01 m/s), or a density (0.01 m/s/sqrt(Hz))")
    ]
    velocity: Annotated[str, Field(description="name of the block of the velocity error")] = "velocity_error"
    stream: Annotated[
        str | None, Field(description="stream with the columns E, N (m/s) (left out: the name of this entry)")
    ] = None
    perfect: Annotated[bool, Field(description="whether a noise of 0 is meant")] = False


def velocity(name: str, cfg: VelocityConfig, context: Any) -> Measurement:
    """H = I over the velocity error, in n, of the rows E and N."""
    covariance = np.diag(np.square(np.broadcast_to(cfg.noise.value, 3)))
    return Measurement(
        name=name,
        all_rows=NAVIGATION.axes,
        rows=NAVIGATION.axes[:2],
        unit="m/s",
        terms=(MeasurementTerm(cfg.velocity, identity(3)),),
        covariance=tuple(tuple(float(x) for x in row) for row in covariance),
        noise=cfg.noise.kind,
        frame="n",
        stream=cfg.stream or name,
        columns=NAVIGATION.axes,
        perfect=cfg.perfect,
        text="the base stands: the computed velocity is its own error",
    )
