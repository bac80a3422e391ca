"""The steps of a recorded INS on flat arrays: what it recorded less what it was corrected by.

A state holds the row of the record at the end of the last step, and the correction, the accumulated error of the INS:

==========  =======================================================================================
state       latitude, longitude, V_E, V_N, heading; phi (3), dV (2), dphi, dlam of the correction
sample      length of the step in s; latitude, longitude, V_E, V_N, heading at its end
row         `VARIABLES`
==========  =======================================================================================

An INS that had been corrected would have gone on without that error. So the correction moves as an error of the INS does, by
the exact platform equations: rates and forces of the corrected INS against those of the recorded one, finite rotations, and the
specific force that the recorded velocity tells. A correction grows to tens of arcmin and m/s; by linear equations the longitude
would be 100 m wrong after 4 h, and the velocity by half of its sigma. Drifts stay with the filter. The acceleration in a row is
that of the corrected INS: what is recorded holds g times the tilt besides, more than a ship's own.
"""

from __future__ import annotations

import numpy as np
from estimfw_inertial.rotation import exponential
from numpy.typing import ArrayLike, NDArray

from estimfw.model.nominal import NominalVariable
from estimfw_ins_errors.local_terms import (
    earth_rate,
    meridian_curvature,
    motion_force,
    prime_vertical_curvature,
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
    moved = _moved(c, before, change, dt, float(params[1]))
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


def _moved(c: FloatArray, before: FloatArray, change: FloatArray, dt: FloatArray, gravity: float) -> FloatArray:
    """The correction (..., 7) a step later, by fourth order Runge-Kutta; the record is even in between."""
    if not np.any(c):
        return c
    acceleration, middle = change[..., 2:4] / dt, before + 0.5 * change
    k1 = error_rate(c, before, acceleration, gravity)
    k2 = error_rate(c + 0.5 * dt * k1, middle, acceleration, gravity)
    k3 = error_rate(c + 0.5 * dt * k2, middle, acceleration, gravity)
    k4 = error_rate(c + dt * k3, before + change, acceleration, gravity)
    return np.asarray(c + dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4))


def error_rate(c: FloatArray, recorded: FloatArray, acceleration: FloatArray, gravity: float) -> FloatArray:
    """Rates (..., 7) of the errors of an INS, by its exact equations.

    With C = exp(-[phi x]), and the index i for what the INS computes of what it records::

        omega = omega_it_i - C omega_it,   phi' = omega + 1/2 phi x omega + 1/12 phi x (phi x omega)
        (C f)_h = V_i' + ((2 omega_ie + omega_et)_i x V_i)_h,   f_z = g + ((2 omega_ie + omega_et) x V)_z
        dV' = V_i' - f_h + ((2 omega_ie + omega_et) x V)_h

    Parameters
    ----------
    c : (..., 7) array
        phi, dV, dphi, dlam.
    recorded : (..., 5) array
        What it records with these errors.
    acceleration : (..., 2) array, m/s^2
        The change of the recorded velocity.
    gravity : float, m/s^2
    """
    phi, L_i, V_i = c[..., :3], recorded[..., 0], recorded[..., 2:4]
    L, V = L_i - c[..., 5], V_i - c[..., 3:5]
    C = exponential(-phi)
    omega = _turn(L_i, V_i) - (C @ _turn(L, V)[..., None])[..., 0]
    across = np.cross(phi, omega)
    force_i, force = _coriolis(L_i, V_i), _coriolis(L, V)
    seen = acceleration + force_i[..., :2] - C[..., :2, 2] * (gravity + force[..., 2:])
    felt = np.linalg.solve(C[..., :2, :2], seen[..., None])[..., 0]
    north = V_i[..., 1] * meridian_curvature(L_i) - V[..., 1] * meridian_curvature(L)
    east_i, east = (v[..., 0] * prime_vertical_curvature(at) / np.cos(at) for v, at in ((V_i, L_i), (V, L)))
    turning = omega + 0.5 * across + np.cross(phi, across) / 12.0
    speeding = acceleration - felt + force[..., :2]
    return np.concatenate([turning, speeding, north[..., None], (east_i - east)[..., None]], axis=-1)


def _turn(L: FloatArray, V: FloatArray) -> FloatArray:
    """omega_it (..., 3) rad/s."""
    return np.asarray(earth_rate(L) + transport_rate(L, V))


def _coriolis(L: FloatArray, V: FloatArray) -> FloatArray:
    """(2 omega_ie + omega_et) x V, (..., 3) m/s^2."""
    return motion_force(L, V, np.zeros(V.shape))
