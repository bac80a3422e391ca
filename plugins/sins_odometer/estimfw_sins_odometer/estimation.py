"""One step of the alignment by estimation (AEBA), in NumPy with leading axes: preintegration, then C_ni with the odometer (K1).

The flat state is that of `preintegration` with C_ni (9) behind it. `VARIABLES` is the layout of a row.
"""

from __future__ import annotations

import numpy as np
from estimfw_inertial.rotation import exponential, logarithm, skew
from numpy.typing import NDArray

from estimfw.model.nominal import NominalVariable
from estimfw_sins_odometer.observation import predicted
from estimfw_sins_odometer.place import earth_rate, lever_arm, transport_matrix
from estimfw_sins_odometer.preintegration import N_STATE as N_PREINTEGRATED
from estimfw_sins_odometer.preintegration import Preintegrated, begin, preintegrate, velocity_observation

__all__ = ["N_STATE", "ROW_SIZE", "VARIABLES", "correct", "difference", "initial", "step"]

FloatArray = NDArray[np.float64]

N_STATE = N_PREINTEGRATED + 9

VARIABLES = (
    NominalVariable("C_bn", (3, 3), "1", "varying", "C_b^n"),
    NominalVariable("C_ni", (3, 3), "1", "varying", "C_n^i"),
    NominalVariable("C_bi", (3, 3), "1", "varying", "C_b^i"),
    NominalVariable("alpha", (3,), "m/s", "varying", r"\alpha"),
    NominalVariable("predicted", (3,), "m/s", "varying", "h"),
    NominalVariable("attitude_sensitivity", (3, 3), "m/s", "varying", r"H_\phi"),
    NominalVariable("gyro_sensitivity", (3, 3), "m", "varying", "J"),
    NominalVariable("accel_sensitivity", (3, 3), "s", "varying", "M_g"),
    NominalVariable("transport_coupling", (3, 3), "1/s", "varying", r"A F_c A^T [\bar r\times]"),
    NominalVariable("speed_coupling", (3,), "1/m", "varying", "A F_c A^T C_b^i e_y"),
    NominalVariable("velocity_n", (3,), "m/s", "varying", "V^n"),
    NominalVariable("omega_ib_i", (3,), "rad/s", "varying", r"\omega_{ib}^i"),
    NominalVariable("omega_in_i", (3,), "rad/s", "varying", r"\omega_{in}^i"),
)
ROW_SIZE = sum(v.size for v in VARIABLES)


def initial(C_ni: FloatArray, velocity_b: FloatArray) -> FloatArray:
    """State (..., 55) at the start."""
    lead = np.broadcast_shapes(C_ni.shape[:-2], velocity_b.shape[:-1])
    state = begin(np.broadcast_to(velocity_b, (*lead, 3)))
    return np.concatenate([state, np.broadcast_to(C_ni, (*lead, 3, 3)).reshape(*lead, 9)], axis=-1)


def step(state: FloatArray, sample: FloatArray, params: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """New state, process row and end row, which are the same: the terms of a step are made of what it went through."""
    pre, turning = preintegrate(state[..., :N_PREINTEGRATED], sample, lever_arm(params))
    now = Preintegrated.of(pre)
    dt = np.broadcast_to(sample[..., 0], pre.shape[:-1])
    mean = (now.S - state[..., 12:15]) / dt[..., None]
    A = np.broadcast_to(state[..., N_PREINTEGRATED:], (*pre.shape[:-1], 9)).reshape(*pre.shape[:-1], 3, 3)
    over_ground = _times(np.swapaxes(A, -1, -2), mean)
    rate = earth_rate(params) + over_ground @ transport_matrix(params).T
    A = A @ exponential(rate * dt[..., None])
    row = row_of(now, A, mean, turning, _times(A, rate), params)
    return np.concatenate([pre, A.reshape(*pre.shape[:-1], 9)], axis=-1), row, row


def row_of(
    now: Preintegrated,
    A: FloatArray,
    mean: FloatArray,
    omega_ib_i: FloatArray,
    omega_in_i: FloatArray,
    params: FloatArray,
) -> FloatArray:
    """A row (..., 81); ``mean`` (..., 3) is the mean of r over the step, m/s."""
    h, H = predicted(A, now, params)
    to_n = np.swapaxes(A, -1, -2)
    turn = A @ transport_matrix(params) @ to_n
    parts = (
        to_n @ now.C_bi, A, now.C_bi, velocity_observation(now), h, H, skew(now.r) @ now.M_g - now.N_g, now.M_g,
        turn @ skew(mean), _times(turn, now.C_bi[..., 1]), _times(to_n, now.r), omega_ib_i, omega_in_i,
    )  # fmt: skip
    lead = h.shape[:-1]
    return np.concatenate([part.reshape(*lead, -1) for part in parts], axis=-1)


def correct(state: FloatArray, delta: FloatArray, params: FloatArray) -> FloatArray:
    """exp([phi x]) C_ni for delta (..., 3) = phi in i (K6)."""
    del params
    lead = np.broadcast_shapes(state.shape[:-1], delta.shape[:-1])
    made = np.broadcast_to(state, (*lead, state.shape[-1])).copy()
    A = made[..., N_PREINTEGRATED:].reshape(*lead, 3, 3)
    made[..., N_PREINTEGRATED:] = (exponential(delta) @ A).reshape(*lead, 9)
    return made


def difference(state: FloatArray, other: FloatArray) -> FloatArray:
    """phi (..., 3) in i that `correct` takes from one state to the C_ni of another."""
    A, B = (s[..., N_PREINTEGRATED:].reshape((*s.shape[:-1], 3, 3)) for s in np.broadcast_arrays(state, other))
    return logarithm(B @ np.swapaxes(A, -1, -2))


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
