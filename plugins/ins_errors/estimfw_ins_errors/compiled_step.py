"""The steps of `recorded_step` for numba, in place on flat arrays."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

__all__ = ["correct", "step"]

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"

A = 6378137.0
E2 = 1.0 / 298.257223563 * (2.0 - 1.0 / 298.257223563)
RATE = 7.292115e-5
TURN = 2.0 * math.pi


@njit(cache=True)
def half_turn(angle):
    return angle - TURN * np.round(angle / TURN)


@njit(cache=True)
def write_row(row, state, shift, part, aE, aN, rate, gravity):
    """The row of recorded + part * shift, less the correction in the state."""
    row[0] = state[0] + part * shift[0] - state[10]
    row[1] = state[1] + part * shift[1] - state[11]
    row[2] = state[2] + part * shift[2] - state[8]
    row[3] = state[3] + part * shift[3] - state[9]
    row[4] = (state[4] + part * shift[4] - state[7]) % TURN
    row[5] = rate
    row[6] = aE
    row[7] = aN
    for i in range(3):
        row[8 + i] = state[5 + i]
    row[11] = gravity


@njit(cache=True)
def step(state, sample, params, process_row, end_row):
    """One step in place; both rows are written."""
    dt = sample[0]
    shift = np.empty(5)
    for i in range(5):
        shift[i] = sample[1 + i] - state[i]
    shift[1] = half_turn(shift[1])
    shift[4] = half_turn(shift[4])
    aE, aN, rate = shift[2] / dt, shift[3] / dt, shift[4] / dt
    write_row(process_row, state, shift, params[0], aE, aN, rate, params[1])
    dE, dN = state[8], state[9]
    move(state, shift, aE, aN, dt, params[1])
    aE, aN = aE - (state[8] - dE) / dt, aN - (state[9] - dN) / dt
    process_row[6], process_row[7] = aE, aN
    write_row(end_row, state, shift, 1.0, aE, aN, rate, params[1])
    for i in range(5):
        state[i] = sample[1 + i]


@njit(cache=True)
def correct(state, delta, params):
    """Errors in the slots attitude, velocity, latitude, longitude are taken out."""
    for i in range(5):
        state[5 + i] += delta[i]
    state[10] += delta[6]
    state[11] += delta[9]


@njit(cache=True)
def move(state, shift, aE, aN, dt, gravity):
    """The correction a step later, by fourth order Runge-Kutta, in place; the record moves by ``shift`` in between."""
    c = state[5:]
    if not np.any(c != 0.0):
        return
    total, y, k = np.zeros(7), c.copy(), np.zeros(7)
    for s in range(4):
        part = 0.0 if s == 0 else (1.0 if s == 3 else 0.5)
        for i in range(7):
            y[i] = c[i] + part * dt * k[i]
        error_rate(
            y, state[0] + part * shift[0], state[2] + part * shift[2], state[3] + part * shift[3], aE, aN, gravity, k
        )  # fmt: skip
        for i in range(7):
            total[i] += (2.0 if s == 1 or s == 2 else 1.0) * k[i]
    for i in range(7):
        c[i] += dt / 6.0 * total[i]


@njit(cache=True)
def rates(L, east, north):
    """omega_it, y and z of 2 omega_ie + omega_et, phi', lam'."""
    s, c = math.sin(L), math.cos(L)
    w = 1.0 - E2 * s * s
    x, y = -north * w**1.5 / (A * (1.0 - E2)), east * math.sqrt(w) / A
    z = y * s / c
    return x, RATE * c + y, RATE * s + z, 2.0 * RATE * c + y, 2.0 * RATE * s + z, -x, y / c


@njit(cache=True)
def error_rate(e, L_i, E_i, N_i, aE, aN, gravity, out):
    """Rates of the errors e of an INS that records latitude, velocity and acceleration, by the exact equations."""
    a, b, c = e[0], e[1], e[2]
    E, N = E_i - e[3], N_i - e[4]
    x_i, y_i, z_i, _, cz_i, north_i, east_i = rates(L_i, E_i, N_i)
    x, y, z, cy, cz, north, east = rates(L_i - e[5], E, N)
    # C = exp(-[phi x]) = I - s [phi x] + q [phi x]^2
    angle = math.sqrt(a * a + b * b + c * c)
    s = math.sin(angle) / angle if angle > 0.0 else 1.0
    q = 2.0 * (math.sin(0.5 * angle) / angle) ** 2 if angle > 0.0 else 0.5
    c00, c01, c02 = 1.0 - q * (b * b + c * c), s * c + q * a * b, -s * b + q * a * c
    c10, c11, c12 = -s * c + q * a * b, 1.0 - q * (a * a + c * c), s * a + q * b * c
    c20, c21, c22 = s * b + q * a * c, -s * a + q * b * c, 1.0 - q * (a * a + b * b)
    wx = x_i - (c00 * x + c01 * y + c02 * z)
    wy = y_i - (c10 * x + c11 * y + c12 * z)
    wz = z_i - (c20 * x + c21 * y + c22 * z)
    px, py, pz = b * wz - c * wy, c * wx - a * wz, a * wy - b * wx
    out[0] = wx + 0.5 * px + (b * pz - c * py) / 12.0
    out[1] = wy + 0.5 * py + (c * px - a * pz) / 12.0
    out[2] = wz + 0.5 * pz + (a * py - b * px) / 12.0
    up = gravity + x * N - cy * E
    sE, sN = aE - cz_i * N_i - c02 * up, aN + cz_i * E_i - c12 * up
    det = c00 * c11 - c01 * c10
    out[3] = aE - (c11 * sE - c01 * sN) / det - cz * N
    out[4] = aN - (c00 * sN - c10 * sE) / det + cz * E
    out[5] = north_i - north
    out[6] = east_i - east
