r"""The platform itself, without small angles: what really happens on a standing base; the error model is the linear part of it.

The real platform stands at ``exp([phi x]) C_pn``, the computer has it at C_pn. It is turned at the rate that the computer
commands, resolved in the axes that the computer believes in, and by its drifts; its accelerometers sense g from where it is::

    omega  = exp([phi x]) (omega_ie + omega_en(V) + C_pn eps) - omega_ie        its rate against the computed one, in n
    phi'   = J(phi) omega,                    J = I - [phi x] / 2 + D(|phi|) [phi x]^2
    V'     = C_pn ((exp([phi x]) C_pn)^T (0, 0, g) + dA) - (2 omega_ie + omega_en(V)) x V        East and North

J takes the rate of a rotation to that of its rotation vector (Bortz 1971). All functions take arrays with leading axes, complex
ones too, so that their Jacobians can be had to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["StandingPlatform", "advanced", "platform_rates"]

Array = NDArray[Any]

#: Below this |phi|^2 the series of three functions of the angle is right to the last digit.
_SMALL = 1e-2


@dataclass(frozen=True, slots=True)
class StandingPlatform:
    """How it is turned and where it stands: C_pn (3, 3), earth_rate_n (3,) rad/s, gravity m/s^2, 1 / R in 1/m, tan L."""

    C_pn: Array
    earth_rate_n: Array
    gravity: float
    curvature: float
    tan_latitude: float


def platform_rates(
    velocity: Array, phi: Array, force_error: Array, drift: Array, platform: StandingPlatform
) -> tuple[Array, Array]:
    """V' (..., 2) m/s^2 and phi' (..., 3) rad/s.

    Parameters
    ----------
    velocity : (..., 2) array, m/s
        Computed, East and North; that of the base is 0.
    phi : (..., 3) array, rad
        In n.
    force_error : (..., 2) array, m/s^2
        Bias and noise of the accelerometers x and y.
    drift : (..., 3) array, rad/s
        Drift and noise of the gyros, in p.
    platform : StandingPlatform
    """
    C, earth = platform.C_pn, platform.earth_rate_n
    east, north = velocity[..., 0], velocity[..., 1]
    over_earth = platform.curvature * np.stack([-north, east, platform.tan_latitude * east], axis=-1)
    real = _exponential(phi)
    omega = _turned(real, earth + over_earth + drift @ C.T) - earth
    up = np.array([0.0, 0.0, platform.gravity])
    level = (_turned(np.swapaxes(real @ C, -1, -2), up)[..., :2] + force_error) @ C[:2, :2].T
    vertical = 2.0 * earth[2] + over_earth[..., 2]
    return level + np.stack([vertical * north, -vertical * east], axis=-1), _turned(_vector_rate(phi), omega)


def advanced(
    velocity: Array, phi: Array, force_error: Array, drift: Array, platform: StandingPlatform, dt: float
) -> tuple[Array, Array]:
    """Velocity and phi after dt (s), in which the errors of the sensors are constant; Runge and Kutta's fourth order.

    The fastest motion has Schuler's period, 84 min: with dt of a second the error is 1e-15 of what moves.
    """

    def rates(V: Array, angle: Array) -> tuple[Array, Array]:
        return platform_rates(V, angle, force_error, drift, platform)

    a = rates(velocity, phi)
    b = rates(velocity + 0.5 * dt * a[0], phi + 0.5 * dt * a[1])
    c = rates(velocity + 0.5 * dt * b[0], phi + 0.5 * dt * b[1])
    d = rates(velocity + dt * c[0], phi + dt * c[1])
    move = [dt / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) for i in range(2)]
    return velocity + move[0], phi + move[1]


def _turned(matrix: Array, vector: Array) -> Array:
    return np.asarray(np.einsum("...ij,...j->...i", matrix, vector))


def _skew(v: Array) -> Array:
    zero = np.zeros_like(v[..., 0])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape((*v.shape, 3))


def _exponential(phi: Array) -> Array:
    """exp([phi x]) (..., 3, 3)."""
    square, cross = np.sum(phi * phi, axis=-1), _skew(phi)
    s, half, small = _safe(square)
    sine = np.where(
        small, _series(square, (1, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880)), np.sin(2.0 * half) / (2.0 * half)
    )
    versine = np.where(
        small, _series(square, (1 / 2, -1 / 24, 1 / 720, -1 / 40320, 1 / 3628800)), 2.0 * np.sin(half) ** 2 / s
    )
    return np.asarray(np.eye(3) + sine[..., None, None] * cross + versine[..., None, None] * (cross @ cross))


def _vector_rate(phi: Array) -> Array:
    """J (..., 3, 3)."""
    square, cross = np.sum(phi * phi, axis=-1), _skew(phi)
    s, half, small = _safe(square)
    series = _series(square, (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160))
    D = np.where(small, series, (1.0 - half / np.tan(half)) / s)
    return np.asarray(np.eye(3) - 0.5 * cross + D[..., None, None] * (cross @ cross))


def _safe(square: Array) -> tuple[Array, Array, Array]:
    """|phi|^2 and |phi| / 2 for the closed forms, 1 and 1/2 where the series is taken; and where that is."""
    small = np.abs(square) < _SMALL
    s = np.where(small, 1.0, square)
    return s, 0.5 * np.sqrt(s), small


def _series(s: Array, coefficients: tuple[float, ...]) -> Array:
    total = np.zeros_like(s)
    for c in reversed(coefficients):
        total = total * s + c
    return total
