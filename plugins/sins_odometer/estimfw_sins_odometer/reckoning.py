r"""One step of dead reckoning with the odometer, in NumPy with leading axes.

Within a step the motion is integrated in the body axes of its start (`preintegration`), then taken to n; gyro biases are taken
off it to first order, which over a second is exact::

    track += exp([-omega_in dt/2 x]) C_bn exp([-M_g eps/2 x]) S
    C_bn  <- exp([-omega_in dt x]) C_bn exp([-M_g eps x]) C_bi,   omega_in = omega_ie_n(L) + F_c v_n

The flat state holds C_bn (9), the track east, north, up (3) m, the velocity in b (3) m/s and the gyro bias (3) rad/s.
"""

from __future__ import annotations

import numpy as np
from estimfw_inertial.earth import RATE
from estimfw_inertial.rotation import exponential
from numpy.typing import NDArray

from estimfw.model.nominal import NominalVariable
from estimfw_sins_odometer.place import lever_arm
from estimfw_sins_odometer.preintegration import Preintegrated, begin, preintegrate

__all__ = ["N_STATE", "ROW_SIZE", "VARIABLES", "initial", "row_of", "step"]

FloatArray = NDArray[np.float64]

N_STATE = 18

VARIABLES = (
    NominalVariable("C_bn", (3, 3), "1", "varying", "C_b^n"),
    NominalVariable("velocity_n", (3,), "m/s", "varying", "V^n"),
    NominalVariable("track", (3,), "m", "varying", "s^n"),
)
ROW_SIZE = sum(v.size for v in VARIABLES)


def initial(C_bn: FloatArray, track: FloatArray, velocity_b: FloatArray, gyro_bias: FloatArray) -> FloatArray:
    """State (..., 18) at the start."""
    lead = np.broadcast_shapes(C_bn.shape[:-2], *(v.shape[:-1] for v in (track, velocity_b, gyro_bias)))
    triads = [np.broadcast_to(v, (*lead, 3)) for v in (track, velocity_b, gyro_bias)]
    return np.concatenate([np.broadcast_to(C_bn, (*lead, 3, 3)).reshape(*lead, 9), *triads], axis=-1)


def step(state: FloatArray, sample: FloatArray, params: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """New state, process row and end row, which are the same."""
    lead = np.broadcast_shapes(state.shape[:-1], sample.shape[:-1])
    state = np.broadcast_to(state, (*lead, N_STATE))
    moved = Preintegrated.of(preintegrate(begin(state[..., 12:15]), sample, lever_arm(params))[0])
    C, track, bias = state[..., :9].reshape(*lead, 3, 3), state[..., 9:12], state[..., 15:18]
    dt = np.broadcast_to(sample[..., 0], lead)[..., None]
    drift, rate = -_times(moved.M_g, bias), _rate(_times(C, state[..., 12:15]), track[..., 1], params)
    way = _times(exponential(-0.5 * dt * rate) @ C @ exponential(0.5 * drift), moved.S)
    track = track + way
    C_end = exponential(-dt * rate) @ C @ exponential(drift) @ moved.C_bi
    velocity_b = _times(np.swapaxes(moved.C_bi, -1, -2), moved.r)
    row = row_of(C_end, track, velocity_b)
    return np.concatenate([C_end.reshape(*lead, 9), track, velocity_b, bias], axis=-1), row, row


def row_of(C_bn: FloatArray, track: FloatArray, velocity_b: FloatArray) -> FloatArray:
    """A row (..., 15)."""
    lead = track.shape[:-1]
    return np.concatenate([C_bn.reshape(*lead, 9), _times(C_bn, velocity_b), track], axis=-1)


def _rate(v: FloatArray, north: FloatArray, params: FloatArray) -> FloatArray:
    """omega_in_n (..., 3) rad/s, at the latitude of the place."""
    L = params[11] + north / params[5]
    east = v[..., 0] / params[6]
    return np.stack([-v[..., 1] / params[5], RATE * np.cos(L) + east, RATE * np.sin(L) + east * np.tan(L)], axis=-1)


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
