r"""What the integrated velocity should be, h(A, t), and its derivative by the attitude error (16b, K3).

With A = C_ni of now, w = A omega_ie_n, P = A D A^T, q = Q1 - w x Q2::

    h     = A Gamma(t) - w x S + g P q
    H_phi = -[(A Gamma) x] - [S x][w x] + g (P ([q x] - [Q2 x][w x]) - [(P q) x])

Gamma(t) is the integral of gravity as the Earth turns it. Only the attitude of now is used: nothing that an early, wrong
attitude made is kept.
"""

from __future__ import annotations

import numpy as np
from estimfw_inertial.rotation import skew
from numpy.typing import NDArray

from estimfw_sins_odometer.place import earth_rate, vertical_turn
from estimfw_sins_odometer.preintegration import Preintegrated

__all__ = ["gravity_integral", "predicted"]

FloatArray = NDArray[np.float64]


def gravity_integral(time: FloatArray, params: FloatArray) -> FloatArray:
    """Gamma(t), (..., 3) m/s in n: (t I - (1 - cos wt)/w^2 [w x] + (wt - sin wt)/w^3 [w x]^2) g_n."""
    rate = earth_rate(params)
    w = float(np.linalg.norm(rate))
    t = np.asarray(time, dtype=float)[..., None]
    g_n = np.array([0.0, 0.0, -params[4]])
    once, twice = np.cross(rate, g_n), np.cross(rate, np.cross(rate, g_n))
    first, second = 2.0 * np.sin(0.5 * w * t) ** 2 / w**2, (w * t - np.sin(w * t)) / w**3
    return np.asarray(t * g_n - first * once + second * twice)


def predicted(A: FloatArray, now: Preintegrated, params: FloatArray) -> tuple[FloatArray, FloatArray]:
    """h (..., 3) m/s in i and H_phi (..., 3, 3) m/s per rad, for A (..., 3, 3)."""
    w = A @ earth_rate(params)
    P = A @ vertical_turn(params) @ np.swapaxes(A, -1, -2)
    gravity = _times(A, gravity_integral(now.time, params))
    q = now.Q1 - np.cross(w, now.Q2)
    g, turned, W = params[4], _times(P, q), skew(w)
    h = gravity - np.cross(w, now.S) + g * turned
    H = -skew(gravity) - skew(now.S) @ W + g * (P @ (skew(q) - skew(now.Q2) @ W) - skew(turned))
    return np.asarray(h), np.asarray(H)


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
