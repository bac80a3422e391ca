"""What the coefficients of the error model read that is no product of the nominal: curvatures, tan and sec, rates, forces.

Each is a derived variable of latitude, velocity and acceleration, so that a policy that holds one of these (``fix_nominal`` of
``velocity_t`` at 0: motion neglected) holds what is made of it too. Height 0; see `estimfw_inertial.earth` for the Earth.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from estimfw_inertial.earth import (
    ECCENTRICITY_SQUARED,
    earth_rate_n,
    meridian_radius,
    prime_vertical_radius,
    transport_rate_n,
)
from numpy.typing import NDArray

from estimfw.model.parts import CompiledFunction, DerivedVariable

__all__ = ["LOCAL_TERMS"]

FloatArray = NDArray[np.float64]


def earth_rate(latitude: FloatArray) -> FloatArray:
    """(0, Omega cos, Omega sin), (..., 3) rad/s."""
    return earth_rate_n(latitude)


def transport_rate(latitude: FloatArray, velocity_t: FloatArray) -> FloatArray:
    """(-Vy / R_M, Vx / R_N, Vx tan / R_N), (..., 3) rad/s."""
    return transport_rate_n(velocity_t, latitude)


def meridian_curvature(latitude: FloatArray) -> FloatArray:
    """1 / R_M, 1/m."""
    return np.asarray(1.0 / meridian_radius(latitude))


def prime_vertical_curvature(latitude: FloatArray) -> FloatArray:
    """1 / R_N, 1/m."""
    return np.asarray(1.0 / prime_vertical_radius(latitude))


def meridian_slope(latitude: FloatArray) -> FloatArray:
    """R_M' / R_M^2 = 3 e^2 sin cos / (w R_M), 1/m."""
    return np.asarray(3.0 * _bulge(latitude) / meridian_radius(latitude))


def prime_vertical_slope(latitude: FloatArray) -> FloatArray:
    """R_N' / R_N^2 = e^2 sin cos / (w R_N), 1/m."""
    return np.asarray(_bulge(latitude) / prime_vertical_radius(latitude))


def tan_latitude(latitude: FloatArray) -> FloatArray:
    """tan of the latitude."""
    return np.asarray(np.tan(latitude))


def sec_latitude(latitude: FloatArray) -> FloatArray:
    """1 / cos of the latitude."""
    return np.asarray(1.0 / np.cos(latitude))


def motion_force(latitude: FloatArray, velocity_t: FloatArray, acceleration_t: FloatArray) -> FloatArray:
    """Specific force less (0, 0, g): V' + (2 omega_ie + omega_it) x V, (..., 3) m/s^2 in t; V' and V have no vertical part."""
    V = np.concatenate([velocity_t, np.zeros_like(velocity_t[..., :1])], axis=-1)
    rate = 2.0 * earth_rate_n(latitude) + transport_rate_n(velocity_t, latitude)
    force = np.cross(rate, V)
    force[..., :2] += acceleration_t
    return np.asarray(force)


def _bulge(latitude: FloatArray) -> FloatArray:
    """e^2 sin cos / w."""
    s = np.sin(latitude)
    return np.asarray(ECCENTRICITY_SQUARED * s * np.cos(latitude) / (1.0 - ECCENTRICITY_SQUARED * s * s))


def _variable(
    name: str, shape: tuple[int, ...], needs: tuple[str, ...], function: Callable[..., Any], unit: str, latex: str
) -> DerivedVariable:
    twin = CompiledFunction("estimfw_ins_errors.compiled_terms", function.__name__)
    return DerivedVariable(name, shape, needs, function, unit=unit, latex=latex, compiled=twin)


#: In an order in which each needs earlier ones, or the provider's variables, only.
LOCAL_TERMS: tuple[DerivedVariable, ...] = (
    _variable("earth_rate_t", (3,), ("latitude",), earth_rate, "rad/s", r"\omega_{ie}"),
    _variable("transport_rate_t", (3,), ("latitude", "velocity_t"), transport_rate, "rad/s", r"\omega_{et}"),
    _variable("meridian_curvature", (), ("latitude",), meridian_curvature, "1/m", r"R_M^{-1}"),
    _variable("prime_vertical_curvature", (), ("latitude",), prime_vertical_curvature, "1/m", r"R_N^{-1}"),
    _variable("meridian_slope", (), ("latitude",), meridian_slope, "1/m", r"(R_M' / R_M^2)"),
    _variable("prime_vertical_slope", (), ("latitude",), prime_vertical_slope, "1/m", r"(R_N' / R_N^2)"),
    _variable("tan_latitude", (), ("latitude",), tan_latitude, "1", r"\tan\varphi"),
    _variable("sec_latitude", (), ("latitude",), sec_latitude, "1", r"\sec\varphi"),
    _variable("motion_force_t", (3,), ("latitude", "velocity_t", "acceleration_t"), motion_force, "m/s^2", r"(f - g)"),
)
