"""The base stands: the mechanized velocity is its own error."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from estimfw_inertial.frames import NAVIGATION
from pydantic import Field

from estimfw.config.types import NoiseLevel, Settings, noise, positive_quantity
from estimfw.model.coefficient import identity, vector
from estimfw.model.parts import Measurement, MeasurementTerm

__all__ = ["ZeroVelocityConfig", "zero_velocity"]


class ZeroVelocityConfig(Settings):
    """z = V_mech (eq. 7); ``every`` is its interval, each step if left out.

    ``reference`` names a stream with columns E, N, U (m/s) of a velocity to compare with instead of zero.
    """

    kind: Literal["sins_static.zero_velocity"]
    noise: Annotated[
        NoiseLevel, noise("m/s"), Field(description="per measurement (0.1 m/s), or a density (0.1 m/s/sqrt(Hz))")
    ]
    every: Annotated[
        Annotated[float, positive_quantity("s")] | None, Field(description="interval; each step if left out")
    ] = None
    velocity: Annotated[str, Field(description="name of the block of the velocity error")] = "velocity_error"
    reference: Annotated[
        str | None, Field(description="stream with the columns E, N, U (m/s) to compare with instead of zero")
    ] = None
    perfect: Annotated[bool, Field(description="whether a noise of 0 is meant")] = False


def zero_velocity(name: str, cfg: ZeroVelocityConfig, context: Any) -> Measurement:
    """H = I over the velocity error, in n; z = V_mech - reference."""
    covariance = np.diag(np.square(np.broadcast_to(cfg.noise.value, 3)))
    axes = NAVIGATION.axes
    return Measurement(
        name=name,
        all_rows=axes,
        rows=axes,
        unit="m/s",
        terms=(MeasurementTerm(cfg.velocity, identity(3)),),
        covariance=tuple(tuple(float(x) for x in row) for row in covariance),
        noise=cfg.noise.kind,
        frame="n",
        innovation=vector("velocity_n"),
        stream=cfg.reference,
        columns=axes if cfg.reference else (),
        sign=-1.0,
        every=cfg.every,
        perfect=cfg.perfect,
        text="the base stands: mechanized velocity minus zero (eq. 7)",
    )
