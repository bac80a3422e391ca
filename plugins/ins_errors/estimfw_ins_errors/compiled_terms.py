"""The derived variables of `local_terms` for numba: the same values, one flat array for each argument and one for the result."""

from __future__ import annotations

import math

from numba import njit

__all__ = [
    "earth_rate", "meridian_curvature", "meridian_slope", "motion_force", "prime_vertical_curvature", "prime_vertical_slope",
    "sec_latitude", "tan_latitude", "transport_rate",
]  # fmt: skip

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"

# Those of estimfw_inertial.earth, to which the tests compare.
A = 6378137.0
E2 = 1.0 / 298.257223563 * (2.0 - 1.0 / 298.257223563)
RATE = 7.292115e-5


@njit(cache=True)
def curvatures(latitude):
    """1 / R_M and 1 / R_N."""
    s = math.sin(latitude)
    w = 1.0 - E2 * s * s
    return w**1.5 / (A * (1.0 - E2)), math.sqrt(w) / A


@njit(cache=True)
def earth_rate(latitude, out):
    out[0] = 0.0
    out[1] = RATE * math.cos(latitude[0])
    out[2] = RATE * math.sin(latitude[0])


@njit(cache=True)
def transport_rate(latitude, velocity, out):
    meridian, prime = curvatures(latitude[0])
    out[0] = -velocity[1] * meridian
    out[1] = velocity[0] * prime
    out[2] = velocity[0] * prime * math.tan(latitude[0])


@njit(cache=True)
def meridian_curvature(latitude, out):
    out[0] = curvatures(latitude[0])[0]


@njit(cache=True)
def prime_vertical_curvature(latitude, out):
    out[0] = curvatures(latitude[0])[1]


@njit(cache=True)
def bulge(latitude):
    s = math.sin(latitude)
    return E2 * s * math.cos(latitude) / (1.0 - E2 * s * s)


@njit(cache=True)
def meridian_slope(latitude, out):
    out[0] = 3.0 * bulge(latitude[0]) * curvatures(latitude[0])[0]


@njit(cache=True)
def prime_vertical_slope(latitude, out):
    out[0] = bulge(latitude[0]) * curvatures(latitude[0])[1]


@njit(cache=True)
def tan_latitude(latitude, out):
    out[0] = math.tan(latitude[0])


@njit(cache=True)
def sec_latitude(latitude, out):
    out[0] = 1.0 / math.cos(latitude[0])


@njit(cache=True)
def motion_force(latitude, velocity, acceleration, out):
    meridian, prime = curvatures(latitude[0])
    east, north = velocity[0], velocity[1]
    x = -north * meridian
    y = 2.0 * RATE * math.cos(latitude[0]) + east * prime
    z = 2.0 * RATE * math.sin(latitude[0]) + east * prime * math.tan(latitude[0])
    out[0] = -z * north + acceleration[0]
    out[1] = z * east + acceleration[1]
    out[2] = x * north - y * east
