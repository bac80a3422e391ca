"""The mechanization as numba loops, in place, without leading axes: the formulas and flat arrays of `mechanization`.

This file stands alone, so that code cached for it is never older than what it is made of. Vectors are tuples of 3, matrices of
9 numbers row by row: nothing is allocated in a step.
"""

from __future__ import annotations

import math

from numba import njit

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"

__all__ = ["correct", "exponential", "step"]


@njit(cache=True)
def exponential(x, y, z):
    """exp([v x]) of the rotation vector v = (x, y, z) in rad, by Rodrigues' formula in half angles.

    Below 0.2 rad sine and cosine are summed as series, whose next terms are less than a rounding.
    """
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
def _sum(a, b, factor):
    """a + factor b."""
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


@njit(cache=True)
def _three(array, at):
    return (array[at], array[at + 1], array[at + 2])


@njit(cache=True)
def _matrix(array):
    return (array[0], array[1], array[2], array[3], array[4], array[5], array[6], array[7], array[8])


@njit(cache=True)
def _compensated(sample, two):
    """phi, the plain and the compensated velocity increment."""
    theta, dvel = _three(sample, 1), _three(sample, 4)
    if not two:
        return theta, dvel, _sum(dvel, _cross(theta, dvel), 0.5)
    theta_1, dvel_1, theta_2, dvel_2 = theta, dvel, _three(sample, 7), _three(sample, 10)
    theta, dvel = _sum(theta_1, theta_2, 1.0), _sum(dvel_1, dvel_2, 1.0)
    sculling = _sum(_cross(theta_1, dvel_2), _cross(dvel_1, theta_2), 1.0)
    push = _sum(_sum(dvel, _cross(theta, dvel), 0.5), sculling, 2.0 / 3.0)
    return _sum(theta, _cross(theta_1, theta_2), 2.0 / 3.0), dvel, push


@njit(cache=True)
def _place_at(latitude, height):
    """WGS-84: omega_ie cos L, omega_ie sin L, g, R_M + h, R_N + h, tan L."""
    a, f, rate = 6378137.0, 1.0 / 298.257223563, 7.292115e-5
    e2, m = f * (2.0 - f), 0.00344978650684
    sine, cosine = math.sin(latitude), math.cos(latitude)
    squared, h = sine * sine, height / a
    w2 = 1.0 - e2 * squared
    w = math.sqrt(w2)
    surface = 9.7803253359 * (1.0 + 0.00193185265241 * squared) / w
    g = surface * (1.0 - 2.0 * (1.0 + f + m - 2.0 * f * squared) * h + 3.0 * h * h)
    return (rate * cosine, rate * sine, g, a * (1.0 - e2) / (w2 * w) + height, a / w + height, math.tan(latitude))


@njit(cache=True)
def _place_of(state, params):
    if params[3] > 0.0:
        return _place_at(state[12], state[14])
    return (params[6], params[7], params[8], params[9], params[10], params[11])


@njit(cache=True)
def _transport(place, V, params):
    if params[2] > 0.0:
        east = V[0] / place[4]
        return (-V[1] / place[3], east, east * place[5])
    return (0.0, 0.0, 0.0)


@njit(cache=True)
def _move(state, V_twice, dt, place):
    latitude = state[12] + 0.5 * V_twice[1] * dt / place[3]
    between = 0.5 * (state[12] + latitude)
    longitude = state[13] + 0.5 * V_twice[0] * dt / (place[4] * math.cos(between))
    state[12] = latitude
    state[13] = math.pi - (math.pi - longitude) % (2.0 * math.pi)
    state[14] += 0.5 * V_twice[2] * dt


@njit(cache=True)
def _write_row(row, C, dvel, phi, dt, rate, V, place, params):
    for i in range(9):
        row[i] = C[i]
    force, turning, transport = _times(C, dvel), _times(C, phi), _transport(place, V, params)
    for i in range(3):
        row[9 + i] = force[i] / dt
        row[12 + i] = turning[i] / dt - rate[i]
        row[15 + i] = V[i]
        row[21 + i] = transport[i]
    row[18], row[19], row[20], row[24] = 0.0, place[0], place[1], place[2]


@njit(cache=True)
def step(state, sample, params, process_row, end_row):
    """One step in place; both rows are written."""
    dt, point = sample[0], params[5]
    C, V = _matrix(state), _three(state, 9)
    phi, dvel, push = _compensated(sample, params[0] > 1.5)
    place = _place_of(state, params)
    transport = _transport(place, V, params)
    rate = (transport[0], place[0] + transport[1], place[1] + transport[2])
    h = -0.5 * dt
    half = exponential(h * rate[0], h * rate[1], h * rate[2])
    full = exponential(-dt * rate[0], -dt * rate[1], -dt * rate[2])

    V_new = _sum(V, _times(half, _times(C, push)), 1.0)
    V_new = (V_new[0], V_new[1], V_new[2] - place[2] * dt)
    if params[1] > 0.0:
        around = (transport[0], 2.0 * place[0] + transport[1], 2.0 * place[1] + transport[2])
        V_new = _sum(V_new, _cross(around, V), -dt)
    if params[4] == 0.0:
        V_new = (V_new[0], V_new[1], 0.0)
    C_new = _product(_product(full, C), exponential(phi[0], phi[1], phi[2]))
    for i in range(9):
        state[i] = C_new[i]
    for i in range(3):
        state[9 + i] = V_new[i]
    if params[3] > 0.0:
        _move(state, _sum(V, V_new, 1.0), dt, place)

    end = _place_of(state, params)
    _write_row(end_row, C_new, dvel, phi, dt, rate, V_new, end, params)
    if point == 1.0:
        for i in range(25):
            process_row[i] = end_row[i]
    elif point == 0.0:
        _write_row(process_row, C, dvel, phi, dt, rate, V, place, params)
    else:
        C_middle = _product(_product(half, C), exponential(0.5 * phi[0], 0.5 * phi[1], 0.5 * phi[2]))
        V_middle = _sum(V, _sum(V_new, V, -1.0), 0.5)
        middle = (
            place[0] + 0.5 * (end[0] - place[0]), place[1] + 0.5 * (end[1] - place[1]), place[2] + 0.5 * (end[2] - place[2]),
            place[3] + 0.5 * (end[3] - place[3]), place[4] + 0.5 * (end[4] - place[4]), place[5] + 0.5 * (end[5] - place[5]),
        )  # fmt: skip
        _write_row(process_row, C_middle, dvel, phi, dt, rate, V_middle, middle, params)


@njit(cache=True)
def correct(state, delta, params):
    """V - dV and exp([phi x]) C_bn in place, for delta = (dV, phi)."""
    C = _product(exponential(delta[3], delta[4], delta[5]), _matrix(state))
    for i in range(9):
        state[i] = C[i]
    for i in range(3):
        state[9 + i] -= delta[i]
    if params[4] == 0.0:
        state[11] = 0.0
