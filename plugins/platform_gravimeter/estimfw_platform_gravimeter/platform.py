"""The nominal ``platform_gravimeter.platform``: how a standing platform is turned, in one position or in several."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from estimfw_inertial.earth import earth_rate_n
from estimfw_inertial.place import SAY_THE_SITE
from estimfw_inertial.rotation import attitude_matrix
from numpy.typing import NDArray
from pydantic import Field, Strict, model_validator

from estimfw.config.generic.stepped_nominal import SteppedNominal
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Settings, Site, positive_quantity, quantity
from estimfw.errors import ConfigError, NumericalError

__all__ = ["PlatformConfig", "Position", "platform"]

FloatArray = NDArray[np.float64]

#: Unit and symbol of each variable.
_SYMBOLS = {
    "C_pn": ("1", "C_p^n"),
    "earth_rate_n": ("rad/s", r"\omega_{ie}^n"),
    "gravity": ("m/s^2", "g"),
    "curvature": ("1/m", "R^{-1}"),
    "tan_latitude": ("1", r"\tan L"),
}


class Position(Settings):
    """From ``time`` on, the platform stands at this angle; it is turned there at once."""

    time: Annotated[float, quantity("s"), Field(description="from when on, in the record's time")] = 0.0
    alpha: Annotated[float, quantity("rad"), Field(description="from East to x, anticlockwise seen from above")]


class PlatformConfig(Settings):
    """A platform that stands at ``alpha``, or at one angle after the other (``positions``), on a spherical Earth."""

    kind: Literal["platform_gravimeter.platform"]
    alpha: Annotated[
        Annotated[float, quantity("rad")] | None,
        Field(description="angle from East to x, anticlockwise seen from above; of a clockwise heading, minus that"),
    ] = None
    positions: Annotated[
        tuple[Position, ...], Strict(False), Field(description="angles over time, in its order, in place of alpha")
    ] = ()
    radius: Annotated[float, positive_quantity("m"), Field(description="of the sphere")] = 6371000.0
    gravity: Annotated[float, positive_quantity("m/s^2"), Field(description="magnitude of gravity")] = 9.80665

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.alpha is None) == (not self.positions):
            given = "both" if self.positions else "neither"
            refuse(f"{given} of alpha and positions given", "alpha: 30 deg, or positions: [{alpha: 30 deg}, ...]")
        times = [p.time for p in self.positions]
        if any(later <= before for before, later in pairwise(times)):
            refuse("the positions do not follow each other in time", "sort them by time", "positions")
        return self

    @property
    def angles(self) -> tuple[tuple[float, float], ...]:
        """(time in s, alpha in rad) of each position."""
        if self.alpha is not None:
            return ((0.0, self.alpha),)
        return tuple((p.time, p.alpha) for p in self.positions)


def platform(cfg: PlatformConfig, site: Site | None) -> SteppedNominal:
    """The provider that a config describes.

    Raises
    ------
    ConfigError
        No site.
    NumericalError
        At a pole, where there is no East.
    """
    if site is None:
        raise ConfigError("nominal platform_gravimeter.platform needs the latitude", hint=SAY_THE_SITE)
    from_pole = np.pi / 2 - abs(site.latitude)
    if from_pole < 1e-9:
        raise NumericalError(
            f"latitude {np.degrees(site.latitude):g} deg: there is no East at a pole, and no gyrocompass",
            hint="take a place at least a degree away from it",
        )
    steps = [(time, _variables(alpha, site.latitude, cfg)) for time, alpha in cfg.angles]
    near = from_pole < np.radians(1.0)
    warning = (
        f"latitude {np.degrees(site.latitude):.4g} deg: within a degree of a pole the Earth's rate hardly shows north"
    )
    return SteppedNominal.of(cfg.kind, steps, _SYMBOLS, warnings=(warning,) if near else ())


def _variables(alpha: float, latitude: float, cfg: PlatformConfig) -> Mapping[str, FloatArray]:
    return {
        "C_pn": attitude_matrix(alpha, 0.0, 0.0),
        "earth_rate_n": earth_rate_n(latitude),
        "gravity": np.array(cfg.gravity),
        "curvature": np.array(1.0 / cfg.radius),
        "tan_latitude": np.tan(latitude),
    }
