r"""A local-level INS with a gimballed platform, by its exact equations: what really happens when it starts wrong and drifts.

With the true rates and forces of the geographic frame t, the platform p (``C_t^p``) and what the INS computes of its own
latitude and velocity (c)::

    C_t^p' = -[omega_tp x] C_t^p,   omega_tp = omega_it(c) + eps - C_t^p omega_it
    V_c'   = C_t^p f + dA - (2 omega_ie(c) + omega_et(c)) x V_c   (horizontal)
    phi_c' = V_N / R_M(phi_c),   lam_c' = V_E / (R_N(phi_c) cos phi_c)
    f      = V' + (2 omega_ie + omega_et) x V + (0, 0, g)

Rotations are finite; nothing is linearised. Fourth order Runge-Kutta, the velocity even between nodes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from estimfw_ins_errors.compiled_terms import RATE, curvatures

__all__ = ["moved_ins"]

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"

#: Place of the true latitude and longitude, C_t^p, velocity, latitude and longitude of the INS in a state.
TRUE, TURN, SPEED, PLACE, N_STATE = 0, 2, 11, 13, 15


@njit(cache=True)
def rates(L, east, north):
    """omega_it (3) and 2 omega_ie + omega_et (3) at a latitude and velocity."""
    M, N = curvatures(L)
    s, c = math.sin(L), math.cos(L)
    x, y, z = -north * M, east * N, east * N * s / c
    return (x, RATE * c + y, RATE * s + z), (x, 2.0 * RATE * c + y, 2.0 * RATE * s + z)


@njit(cache=True)
def slope(state, V, acceleration, drift, bias, gravity, out):
    """d/dt of a state, with the true velocity and acceleration (2), drift (3) and bias (2)."""
    L, E, N = state[TRUE], V[0], V[1]
    M, P = curvatures(L)
    out[0] = N * M
    out[1] = E * P / math.cos(L)
    turn, coriolis = rates(L, E, N)
    f = (
        acceleration[0] - coriolis[2] * N,
        acceleration[1] + coriolis[2] * E,
        gravity + coriolis[0] * N - coriolis[1] * E,
    )
    own, E, N = state[PLACE], state[SPEED], state[SPEED + 1]
    M, P = curvatures(own)
    command, coriolis = rates(own, E, N)
    wx = command[0] + drift[0]
    wy = command[1] + drift[1]
    wz = command[2] + drift[2]
    for j in range(3):
        wx -= state[TURN + j] * turn[j]
        wy -= state[TURN + 3 + j] * turn[j]
        wz -= state[TURN + 6 + j] * turn[j]
    for j in range(3):
        a, b, c = state[TURN + j], state[TURN + 3 + j], state[TURN + 6 + j]
        out[TURN + j] = wz * b - wy * c
        out[TURN + 3 + j] = wx * c - wz * a
        out[TURN + 6 + j] = wy * a - wx * b
    fx, fy = bias[0], bias[1]
    for j in range(3):
        fx += state[TURN + j] * f[j]
        fy += state[TURN + 3 + j] * f[j]
    out[SPEED] = fx + coriolis[2] * N
    out[SPEED + 1] = fy - coriolis[2] * E
    out[PLACE] = N * M
    out[PLACE + 1] = E * P / math.cos(own)


@njit(cache=True)
def moved_ins(states, velocity, dt, drift, bias, gravity):
    """Runs of the INS over all steps.

    Parameters
    ----------
    states : (R, 15) array
        True latitude and longitude, C_t^p, velocity, latitude and longitude of the INS at the start.
    velocity : (N + 1, 2) array, m/s
        True, at the nodes.
    dt : float, s
    drift : (R, N, 3) array, rad/s
        Of the platform, constant over a step.
    bias : (R, N, 2) array, m/s^2
        Of the accelerometers.
    gravity : float

    Returns
    -------
    (R, N + 1, 15) array
    """
    runs, steps = drift.shape[0], drift.shape[1]
    out = np.empty((runs, steps + 1, N_STATE))
    k1, k2, k3, k4, y = np.empty(N_STATE), np.empty(N_STATE), np.empty(N_STATE), np.empty(N_STATE), np.empty(N_STATE)
    for r in range(runs):
        x = states[r].copy()
        out[r, 0] = x
        for k in range(steps):
            begin, end = velocity[k], velocity[k + 1]
            middle, acceleration = 0.5 * (begin + end), (end - begin) / dt
            e, d = drift[r, k], bias[r, k]
            slope(x, begin, acceleration, e, d, gravity, k1)
            y[:] = x + 0.5 * dt * k1
            slope(y, middle, acceleration, e, d, gravity, k2)
            y[:] = x + 0.5 * dt * k2
            slope(y, middle, acceleration, e, d, gravity, k3)
            y[:] = x + dt * k3
            slope(y, end, acceleration, e, d, gravity, k4)
            x += dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            out[r, k + 1] = x
    return out
