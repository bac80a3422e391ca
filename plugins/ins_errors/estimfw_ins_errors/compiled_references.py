"""The derived variables of `references` for numba: one flat array for each argument and one for the result."""

from __future__ import annotations

import math

from numba import njit

__all__ = ["lever_arm", "vehicle_axes", "vehicle_velocity"]

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def lever_arm(heading, arm, out):
    s, c = math.sin(heading[0]), math.cos(heading[0])
    out[0] = arm[0] * c + arm[1] * s
    out[1] = arm[1] * c - arm[0] * s


@njit(cache=True)
def vehicle_axes(heading, out):
    s, c = math.sin(heading[0]), math.cos(heading[0])
    out[0], out[1], out[2], out[3] = c, -s, s, c


@njit(cache=True)
def vehicle_velocity(heading, velocity, out):
    s, c = math.sin(heading[0]), math.cos(heading[0])
    out[0] = c * velocity[0] - s * velocity[1]
    out[1] = s * velocity[0] + c * velocity[1]
