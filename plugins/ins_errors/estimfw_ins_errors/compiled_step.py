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
TERMS = 24


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
    dE, dN, dphi = state[8], state[9], state[10]
    move(state, process_row, dt)
    north, east = place_rate_left_out(state[0], state[2], state[3], dE, dN, dphi)
    more_north, more_east = place_rate_left_out(sample[1], sample[3], sample[4], state[8], state[9], state[10])
    state[10] += 0.5 * dt * (north + more_north)
    state[11] += 0.5 * dt * (east + more_east)
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
def move(state, row, dt):
    """exp(A dt) of the correction, by its series, in place."""
    term, next_term = np.empty(7), np.empty(7)
    still = True
    for i in range(7):
        term[i] = state[5 + i]
        still = still and term[i] == 0.0
    if still:
        return
    matrix = error_matrix(row)
    for k in range(1, TERMS):
        small = True
        for i in range(7):
            total = 0.0
            for j in range(6):
                total += matrix[i, j] * term[j]
            next_term[i] = total * dt / k
            state[5 + i] += next_term[i]
            small = small and abs(next_term[i]) <= 1e-17 * abs(state[5 + i])
        if small:
            break
        for i in range(7):
            term[i] = next_term[i]


@njit(cache=True)
def place_rate_left_out(L, VE, VN, dE, dN, dphi):
    """See `recorded_step`."""
    if dE == 0.0 and dN == 0.0 and dphi == 0.0:
        return 0.0, 0.0
    own, E, N = L - dphi, VE - dE, VN - dN
    s, c = math.sin(own), math.cos(own)
    w = 1.0 - E2 * s * s
    M, P = w**1.5 / (A * (1.0 - E2)), math.sqrt(w) / A
    bulge = E2 * s * c / w
    there, flat = math.sin(L), math.cos(L)
    w = 1.0 - E2 * there * there
    north = VN * (w**1.5 / (A * (1.0 - E2)) - M) + N * 3.0 * bulge * M * dphi
    east = VE * math.sqrt(w) / (A * flat) - (VE + E * (s / c) * dphi) * P / c + E * bulge * P / c * dphi
    return north, east


@njit(cache=True)
def error_matrix(row):
    """The complete error equations, (7, 6): nothing depends on the longitude."""
    L, E, N, g = row[0], row[2], row[3], row[11]
    s, c = math.sin(L), math.cos(L)
    w = 1.0 - E2 * s * s
    M, P = w**1.5 / (A * (1.0 - E2)), math.sqrt(w) / A
    bulge = E2 * s * c / w
    slope_M, slope_P = 3.0 * bulge * M, bulge * P
    tan, sec = s / c, 1.0 / c
    cosine, sine = RATE * c, RATE * s
    east, prime, up = -N * M, E * P, E * P * tan
    wy, wz, k = cosine + prime, sine + up, 2.0 * cosine + E * P * sec * sec
    fx, fy = -(2.0 * sine + up) * N + row[6], (2.0 * sine + up) * E + row[7]
    fz = g + east * N - (2.0 * cosine + prime) * E
    m = np.zeros((7, 6))
    m[0, 1], m[0, 2], m[0, 4], m[0, 5] = wz, -wy, -M, N * slope_M
    m[1, 0], m[1, 2], m[1, 3], m[1, 5] = -wz, east, P, -(sine + E * slope_P)
    m[2, 0], m[2, 1], m[2, 3] = wy, -east, tan * P
    m[2, 5] = cosine + E * P * sec * sec - E * tan * slope_P
    m[3, 1], m[3, 2], m[3, 3], m[3, 4] = -fz, fy, N * tan * P, 2.0 * sine + up
    m[3, 5] = (k - E * tan * slope_P) * N
    m[4, 0], m[4, 2], m[4, 3] = fz, -fx, -2.0 * wz
    m[4, 5] = -(k - E * tan * slope_P) * E
    m[5, 4], m[5, 5] = M, -N * slope_M
    m[6, 3], m[6, 5] = sec * P, E * (P * tan - slope_P) * sec
    return m
