r"""Preintegration of IMU and odometer in i = b(0), of which both alignments are made: NumPy, with leading axes.

Two rows of the stream make a block of T = 2 dt (README, 12a and 12b)::

    C_bi(k+1) = C_bi(k) exp([(dth1 + dth2 + 2/3 dth1 x dth2) x])
    dU  = C_bi(k) (dV1 + dV2 + 1/2 (dth1 + dth2) x (dV1 + dV2) + 2/3 (dth1 x dV2 + dV1 x dth2)),  U += dU
    S, Q1, Q2, M_g: trapezoids over T;  N_g += [dU x] 1/2 (M_g(k) + M_g(k+1))

The flat state holds C_bi (9), U, S, Q1, Q2 (3 each), M_g, N_g (9 each), r, r(0) (3 each) and the time since the start;
`State` names its parts. `estimfw_sins_odometer.compiled` has the same as numba loops.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from estimfw_inertial.rotation import exponential, skew
from numpy.typing import NDArray

__all__ = ["N_STATE", "ROW_COLUMNS", "Preintegrated", "begin", "preintegrate", "velocity_observation"]

FloatArray = NDArray[np.float64]

N_STATE = 46
#: Numbers of a stream row in a sample: dtheta, dvel, speed.
ROW_COLUMNS = 7


@dataclass(frozen=True, slots=True)
class Preintegrated:
    """Parts of a flat state (..., 46), as views with leading axes.

    ``C_bi``, ``M_g`` (s), ``N_g`` (m) are (..., 3, 3); ``U``, ``r``, ``r_start`` (m/s), ``S`` (m), ``Q1`` (m s), ``Q2`` (m s^2)
    are (..., 3); ``time`` (...) in s.
    """

    C_bi: FloatArray
    U: FloatArray
    S: FloatArray
    Q1: FloatArray
    Q2: FloatArray
    M_g: FloatArray
    N_g: FloatArray
    r: FloatArray
    r_start: FloatArray
    time: FloatArray

    @classmethod
    def of(cls, state: FloatArray) -> Preintegrated:
        """The parts; what stands behind them in the state is not read."""
        lead = state.shape[:-1]
        C_bi, M_g, N_g = (state[..., at : at + 9].reshape(*lead, 3, 3) for at in (0, 21, 30))
        U, S, Q1, Q2, r, r_start = (state[..., at : at + 3] for at in (9, 12, 15, 18, 39, 42))
        return cls(C_bi, U, S, Q1, Q2, M_g, N_g, r, r_start, state[..., 45])

    def flat(self) -> FloatArray:
        """(..., 46)."""
        lead = self.time.shape
        parts = (self.C_bi, self.U, self.S, self.Q1, self.Q2, self.M_g, self.N_g, self.r, self.r_start, self.time)
        return np.concatenate([part.reshape(*lead, -1) for part in parts], axis=-1)


def begin(velocity_b: FloatArray) -> FloatArray:
    """State (..., 46) at the start, where the vehicle moves with this velocity (..., 3) m/s in b."""
    v = np.asarray(velocity_b, dtype=float)
    state = np.zeros((*v.shape[:-1], N_STATE))
    state[..., 0:9:4] = 1.0
    state[..., 39:42] = state[..., 42:45] = v
    return state


def preintegrate(state: FloatArray, sample: FloatArray, lever_arm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The state (..., 46) a step later, and the rate of b against i (..., 3) rad/s in i in its last block.

    Parameters
    ----------
    state : (..., 46) array
    sample : (..., 1 + 7 rows) array
        See `samples.odometer_samples`; an even number of rows.
    lever_arm : (3,) array, m
        From the IMU to the odometer, in b.
    """
    lead = np.broadcast_shapes(state.shape[:-1], sample.shape[:-1])
    before = Preintegrated.of(np.broadcast_to(state, (*lead, state.shape[-1])))
    rows = np.broadcast_to(sample[..., 1:], (*lead, sample.shape[-1] - 1)).reshape(*lead, -1, 2, ROW_COLUMNS)
    blocks = rows.shape[-3]
    T = np.broadcast_to(sample[..., 0], lead) / blocks
    phi, push = _compensated(rows)
    C = _attitudes(before.C_bi, exponential(phi))
    dU = _times(C[..., :-1, :, :], push)
    r = np.concatenate([before.r[..., None, :], _times(C[..., 1:, :, :], _velocity(rows, T, lever_arm))], axis=-2)
    tau = (before.time[..., None] + T[..., None] * np.arange(blocks + 1))[..., None]
    half = 0.5 * T[..., None]
    dM = half[..., None, None] * (C[..., :-1, :, :] + C[..., 1:, :, :])
    M = before.M_g[..., None, :, :] + np.cumsum(dM, axis=-3)
    after = Preintegrated(
        C_bi=C[..., -1, :, :],
        U=before.U + dU.sum(axis=-2),
        S=before.S + half * _trapezoid(r),
        Q1=before.Q1 + half * _trapezoid(tau * r),
        Q2=before.Q2 + 0.5 * half * _trapezoid(tau**2 * r),
        M_g=M[..., -1, :, :],
        N_g=before.N_g + np.sum(skew(dU) @ (M - 0.5 * dM), axis=-3),
        r=r[..., -1, :],
        r_start=before.r_start,
        time=tau[..., -1, 0],
    )
    rate = _times(C[..., -2, :, :], phi[..., -1, :]) / T[..., None]
    return after.flat(), rate


def velocity_observation(now: Preintegrated) -> FloatArray:
    """alpha = r - r(0) - U, (..., 3) m/s in i (15)."""
    return np.asarray(now.r - now.r_start - now.U)


def _compensated(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation vector and velocity increment of each block, coning and sculling compensated."""
    first, second = rows[..., 0, :], rows[..., 1, :]
    theta_1, theta_2, dvel_1, dvel_2 = first[..., :3], second[..., :3], first[..., 3:6], second[..., 3:6]
    theta, dvel = theta_1 + theta_2, dvel_1 + dvel_2
    sculling = np.cross(theta_1, dvel_2) + np.cross(dvel_1, theta_2)
    return theta + 2.0 / 3.0 * np.cross(theta_1, theta_2), dvel + 0.5 * np.cross(theta, dvel) + 2.0 / 3.0 * sculling


def _attitudes(C: FloatArray, turns: FloatArray) -> FloatArray:
    """C_bi at the edges of the blocks, (..., blocks + 1, 3, 3)."""
    made = np.empty((*turns.shape[:-3], turns.shape[-3] + 1, 3, 3))
    made[..., 0, :, :] = C
    for k in range(turns.shape[-3]):
        made[..., k + 1, :, :] = made[..., k, :, :] @ turns[..., k, :, :]
    return made


def _velocity(rows: FloatArray, T: FloatArray, lever_arm: FloatArray) -> FloatArray:
    """Of the IMU in b at the end of each block, (..., blocks, 3): that of the odometer less what the turn makes of the lever."""
    rate = rows[..., 1, :3] / (0.5 * T[..., None, None])
    velocity = np.zeros(rate.shape)
    velocity[..., 1] = rows[..., 1, 6]
    return np.asarray(velocity - np.cross(rate, lever_arm))


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])


def _trapezoid(values: FloatArray) -> FloatArray:
    return np.asarray((values[..., :-1, :] + values[..., 1:, :]).sum(axis=-2))
