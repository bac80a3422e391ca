r"""One step of the alignment by determination (ADBA), in NumPy with leading axes (A1 to A6).

The flat state is that of `preintegration`, and behind it C_{n(t)}^{n0} (9), beta (3), K (16), C_{b0}^{n0} (9), latitude.
Gravity and Coriolis are integrated in the navigation axes of the start, with the velocity that the attitude of
the step before gives::

    v_n  = C_{n(t)}^{n0 T} C_{b0}^{n0} (S_{k+1} - S_k) / dt,  0 before the first attitude
    beta += C_{n(t)}^{n0} (dt a + dt^2/2 omega_in x a),  a = g_n - omega_ie_n x v_n
    C_{n(t)}^{n0} <- C_{n(t)}^{n0} exp([omega_in dt x]),  L += v_N dt / (R_M + h)
    K += davenport(beta, alpha) dt
"""

from __future__ import annotations

import numpy as np
from estimfw_inertial.earth import RATE
from estimfw_inertial.rotation import exponential
from numpy.typing import NDArray

from estimfw.model.nominal import NominalVariable
from estimfw_sins_odometer.place import N_PARAMS, lever_arm
from estimfw_sins_odometer.preintegration import N_STATE as N_PREINTEGRATED
from estimfw_sins_odometer.preintegration import Preintegrated, begin, preintegrate, velocity_observation
from estimfw_sins_odometer.wahba import best_rotation, davenport

__all__ = ["N_STATE", "ROW_SIZE", "VARIABLES", "initial", "row_of", "step"]

FloatArray = NDArray[np.float64]

N_STATE = N_PREINTEGRATED + 38
#: Behind the parameters of `place`: vectors normalised, seconds before the first attitude.
NORMALISED, FIRST = N_PARAMS, N_PARAMS + 1
_C, _BETA, _K, _START, _LATITUDE = 46, 55, 58, 74, 83

VARIABLES = (
    NominalVariable("C_bn", (3, 3), "1", "varying", "C_b^n"),
    NominalVariable("C_bi", (3, 3), "1", "varying", "C_b^i"),
    NominalVariable("alpha", (3,), "m/s", "varying", r"\alpha"),
    NominalVariable("beta", (3,), "m/s", "varying", r"\beta"),
    NominalVariable("velocity_n", (3,), "m/s", "varying", "V^n"),
    NominalVariable("misfit", (), "m/s", "varying", r"\sqrt{\lambda/t}"),
)
ROW_SIZE = sum(v.size for v in VARIABLES)


def initial(C_bn: FloatArray, velocity_b: FloatArray, latitude: float) -> FloatArray:
    """State (..., 84) at the start; the attitude counts until the first one is determined."""
    lead = np.broadcast_shapes(C_bn.shape[:-2], velocity_b.shape[:-1])
    state = np.zeros((*lead, N_STATE))
    state[..., :N_PREINTEGRATED] = begin(np.broadcast_to(velocity_b, (*lead, 3)))
    state[..., _C:_BETA:4] = 1.0
    state[..., _START:_LATITUDE] = np.broadcast_to(C_bn, (*lead, 3, 3)).reshape(*lead, 9)
    state[..., _LATITUDE] = latitude
    return state


def step(state: FloatArray, sample: FloatArray, params: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """New state, process row and end row, which are the same."""
    pre, _ = preintegrate(state[..., :N_PREINTEGRATED], sample, lever_arm(params))
    now, lead = Preintegrated.of(pre), pre.shape[:-1]
    state = np.broadcast_to(state, (*lead, N_STATE))
    dt = np.broadcast_to(sample[..., 0], lead)[..., None]
    turned, start = (state[..., at : at + 9].reshape(*lead, 3, 3) for at in (_C, _START))
    begun = (now.time >= params[FIRST])[..., None]
    mean = (now.S - state[..., 12:15]) / dt
    v = np.where(begun, _times(np.swapaxes(turned, -1, -2) @ start, mean), 0.0)
    earth, rate = _rates(v, state[..., _LATITUDE], params)
    pull = np.array([0.0, 0.0, -params[4]]) - params[1] * np.cross(earth, v)
    beta = state[..., _BETA:_K] + _times(turned, dt * pull + 0.5 * dt * dt * np.cross(rate, pull))
    turned = turned @ exponential(rate * dt)
    alpha = velocity_observation(now)
    K = state[..., _K:_START].reshape(*lead, 4, 4) + dt[..., None] * _weighed(beta, alpha, params)
    best, smallest = best_rotation(K)
    start = np.where(begun[..., None], best, start)
    latitude = state[..., _LATITUDE] + v[..., 1] * dt[..., 0] / params[5]
    row = row_of(now, turned, start, beta, np.where(begun[..., 0], smallest, 0.0))
    parts = (turned, beta, K, start, latitude)
    return np.concatenate([pre, *(part.reshape(*lead, -1) for part in parts)], axis=-1), row, row


def row_of(
    now: Preintegrated, turned: FloatArray, start: FloatArray, beta: FloatArray, smallest: FloatArray
) -> FloatArray:
    """A row (..., 28) (A6)."""
    C_in = np.swapaxes(turned, -1, -2) @ start
    misfit = np.sqrt(np.maximum(smallest, 0.0) / np.maximum(now.time, 1e-9))
    parts = (C_in @ now.C_bi, now.C_bi, velocity_observation(now), beta, _times(C_in, now.r), misfit)
    return np.concatenate([part.reshape(*misfit.shape, -1) for part in parts], axis=-1)


def _rates(v: FloatArray, latitude: FloatArray, params: FloatArray) -> tuple[FloatArray, FloatArray]:
    """omega_ie_n and omega_in_n (..., 3) rad/s."""
    earth = np.stack([np.zeros_like(latitude), RATE * np.cos(latitude), RATE * np.sin(latitude)], axis=-1)
    east = v[..., 0] / params[6]
    transport = np.stack([-v[..., 1] / params[5], east, east * np.tan(latitude)], axis=-1)
    return earth, earth + params[1] * transport


def _weighed(beta: FloatArray, alpha: FloatArray, params: FloatArray) -> FloatArray:
    if params[NORMALISED] > 0.0:
        beta, alpha = (u / np.linalg.norm(u, axis=-1, keepdims=True) for u in (beta, alpha))
    return davenport(beta, alpha)


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
