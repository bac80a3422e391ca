"""The place as the flat parameters of both alignments: the Earth at the start, and what is computed of it."""

from __future__ import annotations

import numpy as np
from estimfw_inertial import earth
from numpy.typing import NDArray

__all__ = ["N_PARAMS", "earth_rate", "lever_arm", "pack_params", "transport_matrix", "vertical_turn"]

FloatArray = NDArray[np.float64]

#: rows a step, transport rate on, omega_ie cos L, omega_ie sin L, g, R_M + h, R_N + h, tan L, lever arm (3), latitude, height.
N_PARAMS = 13


def pack_params(
    per_step: int, transport: bool, place: tuple[float, float], lever: tuple[float, float, float]
) -> FloatArray:
    """Parameters (13,) for a place (latitude in rad, height in m) and a lever arm (m) in b."""
    latitude, height = place
    rate = earth.earth_rate_n(latitude)
    radii = (float(earth.meridian_radius(latitude)) + height, float(earth.prime_vertical_radius(latitude)) + height)
    g = float(earth.normal_gravity(latitude, height))
    return np.array(
        [per_step, transport, rate[1], rate[2], g, *radii, np.tan(latitude), *lever, latitude, height], dtype=float
    )


def earth_rate(params: FloatArray) -> FloatArray:
    """omega_ie_n (3,) rad/s."""
    return np.array([0.0, params[2], params[3]])


def lever_arm(params: FloatArray) -> FloatArray:
    """(3,) m in b."""
    return params[8:11]


def transport_matrix(params: FloatArray) -> FloatArray:
    """F_c (3, 3) with omega_en_n = F_c v_n (4); zero where the transport rate is not computed."""
    R_M, R_N, tangent, on = params[5], params[6], params[7], params[1]
    return np.asarray(on * np.array([[0.0, -1.0 / R_M, 0.0], [1.0 / R_N, 0.0, 0.0], [tangent / R_N, 0.0, 0.0]]))


def vertical_turn(params: FloatArray) -> FloatArray:
    """D (3, 3): how the vertical turns with the way over ground (16b); zero where the transport rate is not computed."""
    return np.asarray(params[1] * np.diag([1.0 / params[6], 1.0 / params[5], 0.0]))
