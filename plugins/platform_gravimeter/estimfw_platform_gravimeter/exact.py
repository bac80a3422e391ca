r"""The platform itself, without small angles: what really happens on a standing base; the error model is the linear part of it.

The real platform stands at ``exp([phi x]) C_pn``, the computer has it at C_pn. It is turned at the rate that the computer
commands, resolved in the axes that the computer believes in, and by its drifts; its accelerometers sense g from where it is::

    omega  = exp([phi x]) (omega_ie + omega_en(V) + C_pn eps) - omega_ie        its rate against the computed one, in n
    phi'   = J(phi) omega,                    J = I - [phi x] / 2 + D(|phi|) [phi x]^2
    V'     = C_pn ((exp([phi x]) C_pn)^T (0, 0, g) + dA) - (2 omega_ie + omega_en(V)) x V        East and North

J takes the rate of a rotation to that of its rotation vector (Bortz 1971). They may be complex, so that the Jacobian can be had
to the last digit.
"""

from __future__ import annotations

import numpy as np
from numba import njit

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"

__all__ = ["motion", "platform_rates"]

#: Below this |phi|^2 the series of three functions of the angle are right to the last digit.
SMALL = 1e-2


@njit(cache=True)
def platform_rates(x, sensors, C, earth, place):
    """d/dt of x = (V_E, V_N, phi_E, phi_N, phi_U), in m/s^2 and rad/s.

    ``sensors``: errors of the accelerometers x and y (m/s^2) and drifts x, y, z (rad/s), with noise. ``C`` (3, 3) is C_pn,
    ``earth`` (3,) omega_ie in n, ``place`` g, 1 / R and tan L.
    """
    gravity, curvature, tan_latitude = place[0], place[1], place[2]
    phi = (x[2], x[3], x[4])
    sine, versine, D = _functions_of(phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2])
    azimuth_transport = curvature * tan_latitude * x[0]
    drift = _times(C, (sensors[2], sensors[3], sensors[4]))
    commanded = (
        earth[0] - curvature * x[1] + drift[0],
        earth[1] + curvature * x[0] + drift[1],
        earth[2] + azimuth_transport + drift[2],
    )
    real = _turns(phi, commanded, sine, versine)
    omega = (real[0] - earth[0], real[1] - earth[1], real[2] - earth[2])
    rate = _turns(phi, omega, -0.5, D)
    sensed = _transposed_times(C, _turns(phi, (0.0, 0.0, gravity), -sine, versine))
    force = (sensed[0] + sensors[0], sensed[1] + sensors[1])
    vertical = 2.0 * earth[2] + azimuth_transport
    return (
        C[0, 0] * force[0] + C[0, 1] * force[1] + vertical * x[1],
        C[1, 0] * force[0] + C[1, 1] * force[1] - vertical * x[0],
        rate[0],
        rate[1],
        rate[2],
    )


@njit(cache=True)
def motion(start, sensors, C, earth, place, lengths, out):
    """x of R runs at the ends of K steps into ``out`` (R, K, 5), by Runge and Kutta's fourth order.

    ``start`` (R, 5); ``sensors`` (R, K, 5), constant over a step; ``C`` (K, 3, 3), ``earth`` (K, 3), ``place`` (K, 3), lengths of
    the steps (K,) s. The fastest motion has Schuler's period, 84 min: with steps of a second the error is 1e-15 of what moves.
    """
    x, at, slope = np.empty(5), np.empty(5), np.empty((4, 5))
    for r in range(start.shape[0]):
        x[:] = start[r]
        for k in range(lengths.shape[0]):
            h = lengths[k]
            for stage in range(4):
                part = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
                for i in range(5):
                    at[i] = x[i] + (part * slope[stage - 1, i] if stage else 0.0)
                found = platform_rates(at, sensors[r, k], C[k], earth[k], place[k])
                for i, value in enumerate(found):
                    slope[stage, i] = value
            for i in range(5):
                x[i] += h / 6.0 * (slope[0, i] + 2.0 * slope[1, i] + 2.0 * slope[2, i] + slope[3, i])
                out[r, k, i] = x[i]


@njit(cache=True)
def _functions_of(square):
    """sin t / t, (1 - cos t) / t^2 and D = (1 - t / 2 cot t / 2) / t^2 for t^2."""
    if abs(square) < SMALL:
        return (
            _series(square, (1.0, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880)),
            _series(square, (1 / 2, -1 / 24, 1 / 720, -1 / 40320, 1 / 3628800)),
            _series(square, (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160)),
        )
    half = 0.5 * np.sqrt(square)
    s, c = np.sin(half), np.cos(half)
    return s * c / half, 2.0 * s * s / square, (1.0 - half * c / s) / square


@njit(cache=True)
def _series(s, c):
    return c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * c[4])))


@njit(cache=True)
def _turns(phi, v, once, twice):
    """v + once phi x v + twice phi x (phi x v): exp([+-phi x]) v and J v are of this form."""
    a = _cross(phi, v)
    b = _cross(phi, a)
    return (
        v[0] + once * a[0] + twice * b[0],
        v[1] + once * a[1] + twice * b[1],
        v[2] + once * a[2] + twice * b[2],
    )


@njit(cache=True)
def _cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


@njit(cache=True)
def _times(C, v):
    return (
        C[0, 0] * v[0] + C[0, 1] * v[1] + C[0, 2] * v[2],
        C[1, 0] * v[0] + C[1, 1] * v[1] + C[1, 2] * v[2],
        C[2, 0] * v[0] + C[2, 1] * v[1] + C[2, 2] * v[2],
    )


@njit(cache=True)
def _transposed_times(C, v):
    return (
        C[0, 0] * v[0] + C[1, 0] * v[1] + C[2, 0] * v[2],
        C[0, 1] * v[0] + C[1, 1] * v[1] + C[2, 1] * v[2],
        C[0, 2] * v[0] + C[1, 2] * v[1] + C[2, 2] * v[2],
    )
