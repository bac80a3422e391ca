"""Both alignments as numba loops, in place, without leading axes: the formulas of `estimation` and `determination`.

This file stands alone, so that code cached for it is never older than what it is made of. Vectors are tuples of 3, matrices of
9 numbers row by row; a determination allocates the arrays of one eigenvalue problem in a step.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"

__all__ = ["correct", "determination_step", "estimation_step", "keep", "preintegrate", "reckoning_step"]


@njit(cache=True)
def _exponential(v):
    """exp([v x]), by Rodrigues' formula in half angles; below 0.2 rad by series whose next terms are less than a rounding."""
    x, y, z = v
    q = 0.25 * (x * x + y * y + z * z)
    if q < 0.01:
        k = 0.5 - q / 12.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0)))
        c = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0))))
    else:
        half = math.sqrt(q)
        k, c = 0.5 * math.sin(half) / half, math.cos(half)
    first, second = 2.0 * k * c, 2.0 * k * k
    xx, yy, zz = second * x * x, second * y * y, second * z * z
    xy, xz, yz = second * x * y, second * x * z, second * y * z
    return (
        1.0 - (yy + zz), xy - first * z, xz + first * y,
        xy + first * z, 1.0 - (xx + zz), yz - first * x,
        xz - first * y, yz + first * x, 1.0 - (xx + yy),
    )  # fmt: skip


@njit(cache=True)
def _product(A, B):
    return (
        A[0] * B[0] + A[1] * B[3] + A[2] * B[6], A[0] * B[1] + A[1] * B[4] + A[2] * B[7], A[0] * B[2] + A[1] * B[5] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[3] + A[5] * B[6], A[3] * B[1] + A[4] * B[4] + A[5] * B[7], A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[3] + A[8] * B[6], A[6] * B[1] + A[7] * B[4] + A[8] * B[7], A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
    )  # fmt: skip


@njit(cache=True)
def _transposed(A):
    return (A[0], A[3], A[6], A[1], A[4], A[7], A[2], A[5], A[8])


@njit(cache=True)
def _times(A, v):
    return (
        A[0] * v[0] + A[1] * v[1] + A[2] * v[2],
        A[3] * v[0] + A[4] * v[1] + A[5] * v[2],
        A[6] * v[0] + A[7] * v[1] + A[8] * v[2],
    )


@njit(cache=True)
def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit(cache=True)
def _skew(v):
    return (0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0)


@njit(cache=True)
def _plus(a, b, factor):
    """a + factor b, of vectors."""
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


@njit(cache=True)
def _add(A, B, factor):
    """A + factor B, of matrices."""
    return (
        A[0] + factor * B[0], A[1] + factor * B[1], A[2] + factor * B[2],
        A[3] + factor * B[3], A[4] + factor * B[4], A[5] + factor * B[5],
        A[6] + factor * B[6], A[7] + factor * B[7], A[8] + factor * B[8],
    )  # fmt: skip


@njit(cache=True)
def _three(array, at):
    return (array[at], array[at + 1], array[at + 2])


@njit(cache=True)
def _nine(array, at):
    return (
        array[at], array[at + 1], array[at + 2], array[at + 3], array[at + 4],
        array[at + 5], array[at + 6], array[at + 7], array[at + 8],
    )  # fmt: skip


@njit(cache=True)
def _write(array, at, values):
    for k in range(len(values)):
        array[at + k] = values[k]


@njit(cache=True)
def preintegrate(state, sample, params):
    """The first 46 numbers of a state in place; returns the rate of b against i in the last block, in i."""
    rows = int(params[0])
    T = 2.0 * sample[0] / rows
    lever = _three(params, 8)
    C, U, S, Q1, Q2 = _nine(state, 0), _three(state, 9), _three(state, 12), _three(state, 15), _three(state, 18)
    M, N, r, start = _nine(state, 21), _nine(state, 30), _three(state, 39), state[45]
    turning, time = (0.0, 0.0, 0.0), start
    for k in range(rows // 2):
        at = 1 + 14 * k
        theta_1, dvel_1, theta_2, dvel_2 = (
            _three(sample, at),
            _three(sample, at + 3),
            _three(sample, at + 7),
            _three(sample, at + 10),
        )
        theta, dvel = _plus(theta_1, theta_2, 1.0), _plus(dvel_1, dvel_2, 1.0)
        phi = _plus(theta, _cross(theta_1, theta_2), 2.0 / 3.0)
        sculling = _plus(_cross(theta_1, dvel_2), _cross(dvel_1, theta_2), 1.0)
        dU = _times(C, _plus(_plus(dvel, _cross(theta, dvel), 0.5), sculling, 2.0 / 3.0))
        turning = _times(C, phi)
        C_new = _product(C, _exponential(phi))
        end = _plus((0.0, sample[at + 13], 0.0), _cross(theta_2, lever), -2.0 / T)
        r_new, later = _times(C_new, end), start + T * (k + 1)
        dM = _add(C, C_new, 1.0)
        N = _add(N, _product(_skew(dU), _add(M, dM, 0.25 * T)), 1.0)
        M = _add(M, dM, 0.5 * T)
        U, S = _plus(U, dU, 1.0), _plus(S, _plus(r, r_new, 1.0), 0.5 * T)
        Q1 = _plus(_plus(Q1, r, 0.5 * T * time), r_new, 0.5 * T * later)
        Q2 = _plus(_plus(Q2, r, 0.25 * T * time * time), r_new, 0.25 * T * later * later)
        C, r, time = C_new, r_new, later
    _write(state, 0, C)
    _write(state, 9, U)
    _write(state, 12, S)
    _write(state, 15, Q1)
    _write(state, 18, Q2)
    _write(state, 21, M)
    _write(state, 30, N)
    _write(state, 39, r)
    state[45] = time
    return (turning[0] / T, turning[1] / T, turning[2] / T)


@njit(cache=True)
def _gravity_integral(t, params):
    x, y, g = params[2], params[3], params[4]
    w = math.sqrt(x * x + y * y)
    first = 2.0 * math.sin(0.5 * w * t) ** 2 / (w * w)
    second = (w * t - math.sin(w * t)) / (w * w * w)
    once = (-x * g, 0.0, 0.0)
    twice = (0.0, -y * x * g, x * x * g)
    return (-first * once[0], second * twice[1], -t * g + second * twice[2])


@njit(cache=True)
def _transport(v_n, params):
    on = params[1]
    return (-on * v_n[1] / params[5], on * v_n[0] / params[6], on * v_n[0] * params[7] / params[6])


@njit(cache=True)
def _transport_matrix(params):
    on = params[1]
    return (0.0, -on / params[5], 0.0, on / params[6], 0.0, 0.0, on * params[7] / params[6], 0.0, 0.0)


@njit(cache=True)
def _write_observation(row, at, A, state, params):
    """h and H_phi at their places in a row."""
    S, Q1, Q2, g = _three(state, 12), _three(state, 15), _three(state, 18), params[4]
    w = _times(A, (0.0, params[2], params[3]))
    D = (params[1] / params[6], 0.0, 0.0, 0.0, params[1] / params[5], 0.0, 0.0, 0.0, 0.0)
    P = _product(_product(A, D), _transposed(A))
    gravity = _times(A, _gravity_integral(state[45], params))
    q = _plus(Q1, _cross(w, Q2), -1.0)
    turned, W = _times(P, q), _skew(w)
    _write(row, at, _plus(_plus(gravity, _cross(w, S), -1.0), turned, g))
    H = _add(_product(_skew(S), W), _skew(gravity), 1.0)
    inner = _add(_skew(q), _product(_skew(Q2), W), -1.0)
    G = _add(_product(P, inner), _skew(turned), -1.0)
    _write(row, at + 3, _add(_add((0.0,) * 9, H, -1.0), G, g))


@njit(cache=True)
def estimation_step(state, sample, params, process_row, end_row):
    """One step of the estimation in place; both rows are written, and are the same."""
    before, dt = _three(state, 12), sample[0]
    turning = preintegrate(state, sample, params)
    A, C = _nine(state, 46), _nine(state, 0)
    moved = _plus(_three(state, 12), before, -1.0)
    mean = (moved[0] / dt, moved[1] / dt, moved[2] / dt)
    transport = _transport(_times(_transposed(A), mean), params)
    rate = (transport[0], params[2] + transport[1], params[3] + transport[2])
    A = _product(A, _exponential((rate[0] * dt, rate[1] * dt, rate[2] * dt)))
    _write(state, 46, A)
    to_n, M, r = _transposed(A), _nine(state, 21), _three(state, 39)
    turn = _product(_product(A, _transport_matrix(params)), to_n)
    _write(end_row, 0, _product(to_n, C))
    _write(end_row, 9, A)
    _write(end_row, 18, C)
    _write(end_row, 27, _plus(_plus(r, _three(state, 42), -1.0), _three(state, 9), -1.0))
    _write_observation(end_row, 30, A, state, params)
    _write(end_row, 42, _add(_product(_skew(r), M), _nine(state, 30), -1.0))
    _write(end_row, 51, M)
    _write(end_row, 60, _product(turn, _skew(mean)))
    _write(end_row, 69, _times(turn, (C[1], C[4], C[7])))
    _write(end_row, 72, _times(to_n, r))
    _write(end_row, 75, turning)
    _write(end_row, 78, _times(A, rate))
    for k in range(end_row.shape[0]):
        process_row[k] = end_row[k]


@njit(cache=True)
def correct(state, delta, params):
    """exp([phi x]) C_ni in place, for delta = phi in i."""
    _write(state, 46, _product(_exponential(_three(delta, 0)), _nine(state, 46)))


@njit(cache=True)
def _add_davenport(state, at, beta, alpha, weight):
    """K += ([beta +] - [alpha -])^T ([beta +] - [alpha -]) weight."""
    M = np.zeros((4, 4))
    x, y, z = _plus(beta, alpha, 1.0)
    d = _plus(beta, alpha, -1.0)
    for k in range(3):
        M[0, k + 1], M[k + 1, 0] = -d[k], d[k]
    M[1, 2], M[1, 3], M[2, 1], M[2, 3], M[3, 1], M[3, 2] = -z, y, z, -x, -y, x
    for i in range(4):
        for j in range(4):
            for k in range(4):
                state[at + 4 * i + j] += weight * M[k, i] * M[k, j]


@njit(cache=True)
def _best_rotation(state, at):
    """C with beta = C alpha, and the smallest eigenvalue."""
    K = np.empty((4, 4))
    for i in range(4):
        for j in range(4):
            K[i, j] = state[at + 4 * i + j]
    values, vectors = np.linalg.eigh(K)
    w, x, y, z = vectors[0, 0], vectors[1, 0], vectors[2, 0], vectors[3, 0]
    C = (
        w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
        2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z,
    )  # fmt: skip
    return C, values[0]


@njit(cache=True)
def _unit(v):
    length = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return (v[0] / length, v[1] / length, v[2] / length)


@njit(cache=True)
def determination_step(state, sample, params, process_row, end_row):
    """One step of the determination in place; both rows are written, and are the same."""
    before, dt = _three(state, 12), sample[0]
    preintegrate(state, sample, params)
    turned, start, latitude, time = _nine(state, 46), _nine(state, 74), state[83], state[45]
    v = (0.0, 0.0, 0.0)
    if time >= params[14]:
        moved = _plus(_three(state, 12), before, -1.0)
        v = _times(_transposed(turned), _times(start, (moved[0] / dt, moved[1] / dt, moved[2] / dt)))
    earth = (0.0, 7.292115e-5 * math.cos(latitude), 7.292115e-5 * math.sin(latitude))
    east = v[0] / params[6]
    rate = _plus(earth, (-v[1] / params[5], east, east * math.tan(latitude)), params[1])
    pull = _plus((0.0, 0.0, -params[4]), _cross(earth, v), -params[1])
    push = _plus((dt * pull[0], dt * pull[1], dt * pull[2]), _cross(rate, pull), 0.5 * dt * dt)
    beta = _plus(_three(state, 55), _times(turned, push), 1.0)
    turned = _product(turned, _exponential((rate[0] * dt, rate[1] * dt, rate[2] * dt)))
    r = _three(state, 39)
    alpha = _plus(_plus(r, _three(state, 42), -1.0), _three(state, 9), -1.0)
    if params[13] > 0.0:
        _add_davenport(state, 58, _unit(beta), _unit(alpha), dt)
    else:
        _add_davenport(state, 58, beta, alpha, dt)
    smallest = 0.0
    if time >= params[14]:
        start, smallest = _best_rotation(state, 58)
    _write(state, 46, turned)
    _write(state, 55, beta)
    _write(state, 74, start)
    state[83] = latitude + v[1] * dt / params[5]
    C_in = _product(_transposed(turned), start)
    _write(end_row, 0, _product(C_in, _nine(state, 0)))
    _write(end_row, 9, _nine(state, 0))
    _write(end_row, 18, alpha)
    _write(end_row, 21, beta)
    _write(end_row, 24, _times(C_in, r))
    end_row[27] = math.sqrt(max(smallest, 0.0) / max(time, 1e-9))
    for k in range(end_row.shape[0]):
        process_row[k] = end_row[k]


@njit(cache=True)
def reckoning_step(state, sample, params, process_row, end_row):
    """One step of dead reckoning in place; both rows are written, and are the same."""
    dt, C, track, v, bias = sample[0], _nine(state, 0), _three(state, 9), _three(state, 12), _three(state, 15)
    own = np.zeros(46)
    own[0] = own[4] = own[8] = 1.0
    _write(own, 39, v)
    _write(own, 42, v)
    preintegrate(own, sample, params)
    C_bi, S = _nine(own, 0), _three(own, 12)
    drift = _times(_nine(own, 21), bias)
    v_n, L = _times(C, v), params[11] + track[1] / params[5]
    east = v_n[0] / params[6]
    rate = (
        -v_n[1] / params[5],
        7.292115e-5 * math.cos(L) + east,
        7.292115e-5 * math.sin(L) + east * math.tan(L),
    )
    half = _exponential((-0.5 * dt * rate[0], -0.5 * dt * rate[1], -0.5 * dt * rate[2]))
    full = _exponential((-dt * rate[0], -dt * rate[1], -dt * rate[2]))
    way = _times(half, _times(C, _times(_exponential((-0.5 * drift[0], -0.5 * drift[1], -0.5 * drift[2])), S)))
    track = _plus(track, way, 1.0)
    C = _product(_product(_product(full, C), _exponential((-drift[0], -drift[1], -drift[2]))), C_bi)
    v = _times(_transposed(C_bi), _three(own, 39))
    _write(state, 0, C)
    _write(state, 9, track)
    _write(state, 12, v)
    _write(end_row, 0, C)
    _write(end_row, 9, _times(C, v))
    _write(end_row, 12, track)
    for k in range(end_row.shape[0]):
        process_row[k] = end_row[k]


@njit(cache=True)
def keep(state, delta, params):
    """A determination has nothing to correct."""
