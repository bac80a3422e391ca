"""The measurement model of the compass: computed minus measured baseline."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from estimfw.config.types import NoiseLevel, Settings, noise, quantity_vector
from estimfw.model.coefficient import constant, matrix, skew
from estimfw.model.parts import Measurement, MeasurementTerm

__all__ = ["BaselineConfig", "baseline"]

AXES = ("E", "N", "U")


class BaselineConfig(Settings):
    """z = C_bn l - reading, in n. ``antennas`` is the baseline l in b: right, forward, up."""

    kind: Literal["acme.baseline"]
    antennas: Annotated[tuple[float, float, float], quantity_vector("m", 3)]
    noise: Annotated[NoiseLevel, noise("m")]
    stream: Annotated[str, Field(description="name of the stream with the readings")] = "compass"
    attitude: str = "attitude_error"


def baseline(name: str, cfg: BaselineConfig, context: Any) -> Measurement:
    """Three rows over the attitude error.

    With the computed attitude ``(I - [phi x]) C``, computed minus true baseline is ``-phi x (C l) = [(C l) x] phi``, and
    ``[(C l) x] = C [l x] C^T``.
    """
    context.block(cfg.attitude)
    C, l = matrix("C_bn"), cfg.antennas  # noqa: E741
    covariance = np.diag(np.square(np.broadcast_to(cfg.noise.value, 3)))
    return Measurement(
        name=name,
        all_rows=AXES,
        rows=AXES,
        unit="m",
        terms=(MeasurementTerm(cfg.attitude, C @ skew(l) @ C.T),),
        covariance=tuple(tuple(float(x) for x in row) for row in covariance),
        noise=cfg.noise.kind,
        frame="n",
        innovation=C @ constant(l),
        stream=cfg.stream,
        columns=AXES,
        sign=-1.0,
        text="computed minus measured baseline of the antennas",
    )
