"""The state blocks: errors of attitude, velocity, latitude and longitude of a local-level INS, INS minus truth.

Drifts of its gyros and biases of its accelerometers are generic blocks (``random_constant``, ``gauss_markov``) that the process
``ins_errors.local_level`` couples.
"""

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
from estimfw.model.parts import BlockParts, StateBlock
from estimfw_ins_errors.errors import attitude_error_of, latitude_error_of, longitude_error_of, velocity_error_of
from estimfw_ins_errors.frames import LEVEL
from estimfw_ins_errors.outputs import heading_output, position_output, velocity_output

__all__ = [
    "AttitudeErrorConfig",
    "LatitudeErrorConfig",
    "LongitudeErrorConfig",
    "VelocityErrorConfig",
    "attitude_error",
    "latitude_error",
    "longitude_error",
    "velocity_error",
]

_Two = tuple[float, float]
_Three = tuple[float, float, float]
_SIGMA = "one sigma at the start"
_MEAN = "expected value at the start"


class AttitudeErrorConfig(Settings):
    """phi = (alpha, beta, gamma): tilt about East and North, azimuth error about Up, from t to the platform."""

    kind: Literal["ins_errors.attitude_error"]
    sigma: Annotated[
        _Three, non_negative_quantity_vector("rad", 3), Field(description=f"{_SIGMA}, for all axes or for E, N, U")
    ]
    mean: Annotated[_Three, quantity_vector("rad", 3), Field(description=_MEAN)] = (0.0,) * 3


class VelocityErrorConfig(Settings):
    """dV, INS minus true velocity, East and North."""

    kind: Literal["ins_errors.velocity_error"]
    sigma: Annotated[
        _Two, non_negative_quantity_vector("m/s", 2), Field(description=f"{_SIGMA}, for both axes or for E, N")
    ]
    mean: Annotated[_Two, quantity_vector("m/s", 2), Field(description=_MEAN)] = (0.0,) * 2


class LatitudeErrorConfig(Settings):
    """dphi, INS minus true latitude."""

    kind: Literal["ins_errors.latitude_error"]
    sigma: Annotated[float, non_negative_quantity("rad", examples=("0.0054 arcmin",)), Field(description=_SIGMA)]
    mean: Annotated[float, quantity("rad"), Field(description=_MEAN)] = 0.0


class LongitudeErrorConfig(Settings):
    """dlam, INS minus true longitude; nothing depends on it, so it may be left out where nobody asks for longitude."""

    kind: Literal["ins_errors.longitude_error"]
    sigma: Annotated[float, non_negative_quantity("rad", examples=("0.0076 arcmin",)), Field(description=_SIGMA)]
    mean: Annotated[float, quantity("rad"), Field(description=_MEAN)] = 0.0


def attitude_error(name: str, cfg: AttitudeErrorConfig, site: Site | None) -> BlockParts:
    """phi in t, rad; brings the output ``heading``."""
    block = StateBlock(
        name, LEVEL.axes, LEVEL.axes, "rad", "arcmin", frame="t", home_frame="t",
        quantity="attitude", latex=r"\phi", truth_error=attitude_error_of,
    )  # fmt: skip
    return BlockParts(block, _diagonal(cfg.sigma), cfg.mean, frames=(LEVEL,), outputs=(heading_output(name),))


def velocity_error(name: str, cfg: VelocityErrorConfig, site: Site | None) -> BlockParts:
    """dV in t, m/s, its horizontal axes; brings the output ``velocity``."""
    block = StateBlock(
        name, LEVEL.axes, LEVEL.axes[:2], "m/s", "m/s", frame="t", home_frame="t",
        quantity="velocity", latex=r"\delta V", truth_error=velocity_error_of,
    )  # fmt: skip
    return BlockParts(
        block, _diagonal((*cfg.sigma, 0.0)), (*cfg.mean, 0.0), frames=(LEVEL,), outputs=(velocity_output(name),)
    )


def latitude_error(name: str, cfg: LatitudeErrorConfig, site: Site | None) -> BlockParts:
    """dphi, rad; brings the output ``latitude``."""
    block = StateBlock(
        name, ("",), ("",), "rad", "arcmin", quantity="latitude", latex=r"\delta\varphi", truth_error=latitude_error_of
    )
    return BlockParts(block, _diagonal((cfg.sigma,)), (cfg.mean,), outputs=(position_output("latitude", name),))


def longitude_error(name: str, cfg: LongitudeErrorConfig, site: Site | None) -> BlockParts:
    """dlam, rad; brings the output ``longitude``."""
    block = StateBlock(
        name, ("",), ("",), "rad", "arcmin", quantity="longitude", latex=r"\delta\lambda", truth_error=longitude_error_of
    )  # fmt: skip
    return BlockParts(block, _diagonal((cfg.sigma,)), (cfg.mean,), outputs=(position_output("longitude", name),))


def _diagonal(sigma: ArrayLike) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(x) for x in row) for row in np.diag(np.square(sigma)))
