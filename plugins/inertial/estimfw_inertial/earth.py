"""The Earth of WGS-84: its shape, its gravity, its rate, and the turn of the local level over it.

Latitudes are geodetic, in rad; heights above the ellipsoid, in m; vectors in n (East, North, Up). Every argument may have
leading axes. Source: NIMA TR8350.2, *World Geodetic System 1984*, third edition, chapters 3 and 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "ECCENTRICITY_SQUARED",
    "EQUATORIAL_GRAVITY",
    "FLATTENING",
    "GRAVITY_RATIO",
    "RATE",
    "SEMI_MAJOR_AXIS",
    "SOMIGLIANA",
    "earth_rate_n",
    "meridian_radius",
    "normal_gravity",
    "prime_vertical_radius",
    "transport_rate_n",
]

FloatArray = NDArray[np.float64]

#: a, m.
SEMI_MAJOR_AXIS = 6378137.0
#: f = (a - b) / a.
FLATTENING = 1.0 / 298.257223563
#: e^2 = f (2 - f).
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
#: omega_ie, rad/s.
RATE = 7.292115e-5
#: Normal gravity at the equator on the ellipsoid, m/s^2.
EQUATORIAL_GRAVITY = 9.7803253359
#: k of Somigliana's formula: b gamma_pole / (a gamma_equator) - 1.
SOMIGLIANA = 0.00193185265241
#: m = omega_ie^2 a^2 b / GM.
GRAVITY_RATIO = 0.00344978650684


def meridian_radius(latitude: ArrayLike) -> FloatArray:
    """Radius of curvature from north to south, R_M = a (1 - e^2) / (1 - e^2 sin^2 L)^(3/2), m."""
    return np.asarray(SEMI_MAJOR_AXIS * (1.0 - ECCENTRICITY_SQUARED) / _flattened(latitude) ** 1.5)


def prime_vertical_radius(latitude: ArrayLike) -> FloatArray:
    """Radius of curvature from east to west, R_N = a / (1 - e^2 sin^2 L)^(1/2), m."""
    return np.asarray(SEMI_MAJOR_AXIS / np.sqrt(_flattened(latitude)))


def normal_gravity(latitude: ArrayLike, height: ArrayLike = 0.0) -> FloatArray:
    r"""Magnitude of normal gravity in m/s^2; in n it is (0, 0, -g).

    Somigliana's formula, exact on the ellipsoid, and its continuation upwards to second order in height (TR8350.2, 4-1 and 4-3)::

        g_0 = g_e (1 + k sin^2 L) / sqrt(1 - e^2 sin^2 L)
        g   = g_0 (1 - 2 h / a (1 + f + m - 2 f sin^2 L) + 3 h^2 / a^2)
    """
    squared, h = np.sin(latitude) ** 2, np.asarray(height, dtype=float) / SEMI_MAJOR_AXIS
    surface = EQUATORIAL_GRAVITY * (1.0 + SOMIGLIANA * squared) / np.sqrt(_flattened(latitude))
    slope = 2.0 * (1.0 + FLATTENING + GRAVITY_RATIO - 2.0 * FLATTENING * squared)
    return np.asarray(surface * (1.0 - slope * h + 3.0 * h * h))


def earth_rate_n(latitude: ArrayLike) -> FloatArray:
    """omega_ie_n = omega_ie (0, cos L, sin L), (..., 3) rad/s."""
    L = np.asarray(latitude, dtype=float)
    return np.stack([np.zeros_like(L), RATE * np.cos(L), RATE * np.sin(L)], axis=-1)


def transport_rate_n(velocity_n: ArrayLike, latitude: ArrayLike, height: ArrayLike = 0.0) -> FloatArray:
    """omega_en_n = (-V_N / (R_M + h), V_E / (R_N + h), V_E tan L / (R_N + h)), (..., 3) rad/s.

    Parameters
    ----------
    velocity_n : (..., 3) array, m/s
    latitude, height : (...) array, rad and m
        Not at a pole, where n is not defined.
    """
    V, h = np.asarray(velocity_n, dtype=float), np.asarray(height, dtype=float)
    east = V[..., 0] / (prime_vertical_radius(latitude) + h)
    north = V[..., 1] / (meridian_radius(latitude) + h)
    return np.stack(np.broadcast_arrays(-north, east, east * np.tan(latitude)), axis=-1)


def _flattened(latitude: ArrayLike) -> FloatArray:
    return np.asarray(1.0 - ECCENTRICITY_SQUARED * np.sin(latitude) ** 2)
