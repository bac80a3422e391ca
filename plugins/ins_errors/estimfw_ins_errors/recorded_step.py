"""The steps of a recorded INS on flat arrays: what it recorded less what it was corrected by.

A state holds the row of the record at the end of the last step, and the correction, the accumulated error of the INS:

==========  =======================================================================================
state       latitude, longitude, V_E, V_N, heading; phi (3), dV (2), dphi, dlam of the correction
sample      length of the step in s; latitude, longitude, V_E, V_N, heading at its end
row         `VARIABLES`
==========  =======================================================================================

An INS that had been corrected would have gone on without that error. So the correction moves as an error of the INS does, by the
complete error equations (`estimfw_ins_errors.local_level`) at the corrected nominal; drifts stay with the filter. A correction
grows to tens of arcmin and m/s, so of the place the second order counts too: without it the longitude is 100 m wrong after 4 h.
The acceleration in a row is that of the corrected INS: what is recorded holds g times the tilt besides, more than a ship's own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.model.nominal import NominalVariable
from estimfw_ins_errors.local_terms import (
    earth_rate,
    meridian_curvature,
    meridian_slope,
    motion_force,
    prime_vertical_curvature,
    prime_vertical_slope,
    transport_rate,
)

__all__ = [
    "CORRECTION",
    "N_SAMPLE",
    "N_STATE",
    "RECORDED",
    "VARIABLES",
    "correct",
    "difference",
    "error_rate",
    "row_of",
    "step",
]

FloatArray = NDArray[np.float64]

#: Quantities of a row of the record, and of the correction.
RECORDED, CORRECTION = 5, 7
N_STATE, N_SAMPLE = RECORDED + CORRECTION, 1 + RECORDED
TURN = 2.0 * np.pi
#: Terms of the exponential series of the error equations over a step.
TERMS = 24

VARIABLES = (
    NominalVariable("latitude", (), "rad", "varying", r"\varphi"),
    NominalVariable("longitude", (), "rad", "varying", r"\lambda"),
    NominalVariable("velocity_t", (2,), "m/s", "varying", "V"),
    NominalVariable("heading", (), "rad", "varying", "K"),
    NominalVariable("heading_rate", (), "rad/s", "varying", r"\dot K"),
    NominalVariable("acceleration_t", (2,), "m/s^2", "varying", r"\dot V"),
    NominalVariable("attitude_correction", (3,), "rad", "varying", r"\phi_c"),
    NominalVariable("gravity", (), "m/s^2", "constant", "g"),
)


def row_of(
    recorded: FloatArray, correction: FloatArray, acceleration: FloatArray, heading_rate: FloatArray, gravity: ArrayLike
) -> FloatArray:
    """A row (..., 12) of the corrected INS.

    Parameters
    ----------
    recorded : (..., 5) array
    correction : (..., 7) array
    acceleration : (..., 2) array, m/s^2
    heading_rate : (...) array, rad/s
    gravity : float, m/s^2
    """
    place = recorded[..., :2] - correction[..., 5:]
    V = recorded[..., 2:4] - correction[..., 3:5]
    K = np.mod(recorded[..., 4] - correction[..., 2], TURN)
    g = np.broadcast_to(gravity, K.shape)
    parts = [place, V, K[..., None], heading_rate[..., None], acceleration, correction[..., :3], g[..., None]]
    return np.concatenate(parts, axis=-1)


def step(state: FloatArray, sample: FloatArray, params: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """New state, process row, end row.

    Parameters
    ----------
    state : (..., 12) array
    sample : (..., 6) array
    params : (2,) array
        Where in the step the process row is taken (0 start .. 1 end), and gravity.
    """
    dt, after = sample[..., :1], sample[..., 1:]
    before, c = state[..., :RECORDED], state[..., RECORDED:]
    change = after - before
    change[..., 4] = _half_turn(change[..., 4])
    change[..., 1] = _half_turn(change[..., 1])
    acceleration, rate = change[..., 2:4] / dt, change[..., 4] / dt[..., 0]
    process_row = row_of(before + params[0] * change, c, acceleration, rate, params[1])
    moved = _moved(c, before, after, process_row, dt)
    acceleration = acceleration - (moved[..., 3:5] - c[..., 3:5]) / dt
    process_row[..., 6:8] = acceleration
    end_row = row_of(before + change, moved, acceleration, rate, params[1])
    return np.concatenate([after, moved], axis=-1), process_row, end_row


def correct(state: FloatArray, delta: FloatArray, params: FloatArray) -> FloatArray:
    """The state with the errors (..., 12) in the slots attitude, velocity, latitude, longitude taken out."""
    del params
    new = state.copy()
    new[..., 5:10] += delta[..., :5]
    new[..., 10] += delta[..., 6]
    new[..., 11] += delta[..., 9]
    return new


def difference(state: FloatArray, other: FloatArray) -> FloatArray:
    """By which errors (..., 12) the one has to be corrected to be the other."""
    c = other[..., RECORDED:] - state[..., RECORDED:]
    delta = np.zeros((*c.shape[:-1], 12))
    delta[..., :5], delta[..., 6], delta[..., 9] = c[..., :5], c[..., 5], c[..., 6]
    return delta


def _half_turn(angle: FloatArray) -> FloatArray:
    """In -pi .. pi."""
    return np.asarray(angle - TURN * np.round(angle / TURN))


def _moved(c: FloatArray, before: FloatArray, after: FloatArray, row: FloatArray, dt: FloatArray) -> FloatArray:
    """The correction (..., 7) a step later: exp(A dt) c, by its series, and what the place moves besides."""
    total, term = c, c
    if not np.any(c):
        return c
    for k in range(1, TERMS):
        term = error_rate(term, row) * (dt / k)
        total = total + term
        if np.all(np.abs(term) <= 1e-17 * np.abs(total)):
            break
    total[..., 5:] += 0.5 * dt * (place_rate_left_out(before, c) + place_rate_left_out(after, total))
    return total


def place_rate_left_out(recorded: FloatArray, c: FloatArray) -> FloatArray:
    """By how much the rates (..., 2) of latitude and longitude of the record and of the corrected INS differ, less `error_rate`.

    Parameters
    ----------
    recorded : (..., 5) array
    c : (..., 7) array
        The correction.
    """
    L, VE, VN = recorded[..., 0], recorded[..., 2], recorded[..., 3]
    _, _, _, dE, dN, dphi, _ = np.moveaxis(c, -1, 0)
    own, E, N = L - dphi, VE - dE, VN - dN
    M, P, sec, tan = meridian_curvature(own), prime_vertical_curvature(own), 1.0 / np.cos(own), np.tan(own)
    north = VN * meridian_curvature(L) - VN * M + N * meridian_slope(own) * dphi
    east = VE * prime_vertical_curvature(L) / np.cos(L) - (VE + E * tan * dphi) * P * sec
    east = east + E * prime_vertical_slope(own) * sec * dphi
    return np.stack([north, east], axis=-1)


def error_rate(c: FloatArray, row: FloatArray) -> FloatArray:
    """A c (..., 7) of errors c (..., 7): the complete error equations at a row (..., 12)."""
    L, V, g = row[..., 0], row[..., 2:4], row[..., 11]
    VE, VN = V[..., 0], V[..., 1]
    acceleration = row[..., 6:8]
    alpha, beta, gamma, dE, dN, dphi, _ = np.moveaxis(c, -1, 0)
    _, cosine, sine = np.moveaxis(earth_rate(L), -1, 0)
    east, prime, up = np.moveaxis(transport_rate(L, V), -1, 0)
    fx, fy, fz = np.moveaxis(motion_force(L, V, acceleration), -1, 0)
    M, N, slope_M, slope_N = (
        meridian_curvature(L),
        prime_vertical_curvature(L),
        meridian_slope(L),
        prime_vertical_slope(L),
    )
    tan, sec = np.tan(L), 1.0 / np.cos(L)
    wy, wz, k = cosine + prime, sine + up, 2.0 * cosine + VE * N * sec * sec
    rates = [
        wz * beta - wy * gamma - dN * M + VN * slope_M * dphi,
        -wz * alpha + east * gamma + dE * N - (sine + VE * slope_N) * dphi,
        wy * alpha - east * beta + tan * N * dE + (cosine + VE * N * sec * sec - VE * tan * slope_N) * dphi,
        fy * gamma
        - (g + fz) * beta
        + VN * tan * N * dE
        + (2.0 * sine + up) * dN
        + (k - VE * tan * slope_N) * VN * dphi,
        (g + fz) * alpha - fx * gamma - 2.0 * wz * dE - (k - VE * tan * slope_N) * VE * dphi,
        dN * M - VN * slope_M * dphi,
        dE * sec * N + VE * (N * tan - slope_N) * sec * dphi,
    ]
    return np.stack(rates, axis=-1)
