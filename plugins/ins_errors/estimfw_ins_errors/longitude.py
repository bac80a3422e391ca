"""The longitude error, integrated apart: nothing else depends on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw_ins_errors.local_terms import prime_vertical_curvature

__all__ = ["longitude_error_rate", "trapezoid"]

FloatArray = NDArray[np.float64]


def longitude_error_rate(latitude: FloatArray, V_E: FloatArray, dV_E: FloatArray, dphi: FloatArray) -> FloatArray:
    """dlam' = dVx sec / R_N + (Vx / R_N) tan sec dphi, rad/s; arguments (...) in rad and m/s, of one shape or broadcast."""
    sec = 1.0 / np.cos(latitude)
    return np.asarray((dV_E + V_E * np.tan(latitude) * dphi) * sec * prime_vertical_curvature(latitude))


def trapezoid(time: FloatArray, rate: FloatArray) -> FloatArray:
    """The integral (..., K) of a rate (..., K) from the first of the instants (K,), by the trapezoid rule."""
    steps = 0.5 * np.diff(time) * (rate[..., 1:] + rate[..., :-1])
    return np.concatenate([np.zeros((*rate.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)
