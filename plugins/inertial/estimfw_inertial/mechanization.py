r"""Strapdown mechanization in East, North, Up: one step, and its correction, as functions of flat arrays.

A step covers an interval dt with one or two sub-samples (dtheta_k, dvel_k). With phi the rotation vector of b over the step
and dv the velocity increment in the axes that b had at its start::

    one sample:   phi = dtheta                                    dv = dvel + dtheta x dvel / 2
    two samples:  phi = dtheta + 2/3 dtheta_1 x dtheta_2          dv = dvel + dtheta x dvel / 2
                        (coning)                                       + 2/3 (dtheta_1 x dvel_2 + dvel_1 x dtheta_2)

    omega_in = omega_ie + omega_en
    V    <- V + exp(-[omega_in dt/2 x]) C_bn dv + (0, 0, -g) dt - (2 omega_ie + omega_en) x V dt
    C_bn <- exp(-[omega_in dt x]) C_bn exp([phi x])

omega_en is zero unless ``transport_rate`` is computed, and V has no Coriolis unless ``coriolis`` is. Without
``vertical_channel`` V_U is held at 0. With ``position_update`` the position moves with the mean of V before and after, and
gravity and rates follow it; without, they are those of the start.

Sources: Savage, *J. Guid. Control Dyn.* 21 (1998) 19 and 208; Miller, *J. Guid. Control Dyn.* 6 (1983) 287 (two samples).

Flat arrays
-----------
* state (15): C_bn row by row (9), V_n (3), latitude, longitude, height.
* sample (1 + 6 k): dt, then dtheta (3) and dvel (3) of each of k sub-samples.
* params (12): samples a step; coriolis, transport_rate, position_update, vertical_channel computed (1) or not (0); the point of
  the interval where a process row is taken (0, 1/2, 1); the place at the start (6).
* place (6): omega_ie cos L, omega_ie sin L, g, R_M + h, R_N + h, tan L.
* row (25): C_bn (9), f_n (3), omega_nb_n (3), V_n (3), omega_ie_n (3), omega_en_n (3), g.

All may have leading axes, which broadcast.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimfw_inertial.earth import RATE, meridian_radius, normal_gravity, prime_vertical_radius
from estimfw_inertial.rotation import exponential, logarithm, skew, wrapped

__all__ = [
    "N_STATE",
    "OPERATIONS",
    "ROW_SIZE",
    "Switches",
    "compensated",
    "correct",
    "pack_params",
    "place_at",
    "rates",
    "row_of",
    "sample_size",
    "step",
    "switches",
]

FloatArray = NDArray[np.float64]

N_STATE = 15
ROW_SIZE = 25
#: What can be switched, in the order of ``params``.
OPERATIONS = ("coriolis", "transport_rate", "position_update", "vertical_channel")


class Switches(NamedTuple):
    """``params``, unpacked."""

    samples: int
    coriolis: bool
    transport_rate: bool
    position_update: bool
    vertical_channel: bool
    point: float
    place: FloatArray


def sample_size(samples: int) -> int:
    """Numbers in a sample."""
    return 1 + 6 * samples


def place_at(latitude: FloatArray, height: FloatArray) -> FloatArray:
    """omega_ie cos L, omega_ie sin L, g, R_M + h, R_N + h, tan L: (..., 6)."""
    parts = (
        RATE * np.cos(latitude),
        RATE * np.sin(latitude),
        normal_gravity(latitude, height),
        meridian_radius(latitude) + height,
        prime_vertical_radius(latitude) + height,
        np.tan(latitude),
    )
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def pack_params(samples: int, computed: frozenset[str], point: float, place: FloatArray) -> FloatArray:
    """``params`` (12,) from what is computed; see the module."""
    return np.array([samples, *(name in computed for name in OPERATIONS), point, *place], dtype=float)


def step(state: FloatArray, sample: FloatArray, params: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """New state (..., 15), process row (..., 25) and end row (..., 25)."""
    on = switches(params)
    lead = np.broadcast_shapes(state.shape[:-1], sample.shape[:-1])
    state, sample = np.broadcast_to(state, (*lead, state.shape[-1])), np.broadcast_to(sample, (*lead, sample.shape[-1]))
    C, V, dt = state[..., :9].reshape((*lead, 3, 3)), state[..., 9:12], sample[..., :1]
    phi, dvel, push = compensated(sample, on.samples)
    place = _place_of(state, on)
    earth, transport = rates(place, V, on)
    rate = earth + transport
    turns = exponential(np.stack([-0.5 * dt * rate, -dt * rate, -on.point * dt * rate, phi, on.point * phi]))

    V_new = V + _times(turns[0], _times(C, push))
    V_new[..., 2] -= place[..., 2] * dt[..., 0]
    if on.coriolis:
        V_new -= _times(skew(2.0 * earth + transport), V) * dt
    if not on.vertical_channel:
        V_new[..., 2] = 0.0
    C_new = _product(_product(turns[1], C), turns[3])
    position = _moved(state[..., 12:], V + V_new, dt[..., 0], place) if on.position_update else state[..., 12:]
    new = np.concatenate([C_new.reshape((*lead, 9)), V_new, position], axis=-1)

    mean_force, mean_rate = dvel / dt, phi / dt
    end = _place_of(new, on)
    C_point = _product(_product(turns[2], C), turns[4])
    V_point, place_point = V + on.point * (V_new - V), place + on.point * (end - place)
    process_row = row_of(
        C_point, _times(C_point, mean_force), _times(C_point, mean_rate) - rate, V_point, place_point, on
    )
    return new, process_row, row_of(C_new, _times(C_new, mean_force), _times(C_new, mean_rate) - rate, V_new, end, on)


def correct(state: FloatArray, delta: FloatArray, params: FloatArray) -> FloatArray:
    """V - dV and exp([phi x]) C_bn for ``delta`` = (dV, phi), (..., 6); V_U stays 0 where it is held."""
    lead = np.broadcast_shapes(state.shape[:-1], delta.shape[:-1])
    new = np.broadcast_to(state, (*lead, N_STATE)).copy()
    C = new[..., :9].reshape((*lead, 3, 3))
    new[..., :9] = _product(exponential(delta[..., 3:6]), C).reshape((*lead, 9))
    new[..., 9:12] -= delta[..., :3]
    if not switches(params).vertical_channel:
        new[..., 11] = 0.0
    return new


def difference(state: FloatArray, other: FloatArray) -> FloatArray:
    """(dV, phi), (..., 6), that `correct` takes from one state to the attitude and velocity of another; positions stay apart."""
    C, C_other = (a[..., :9].reshape((*a.shape[:-1], 3, 3)) for a in np.broadcast_arrays(state, other))
    phi = logarithm(_product(C_other, np.swapaxes(C, -1, -2)))
    return np.concatenate([state[..., 9:12] - other[..., 9:12], phi], axis=-1)


def compensated(sample: FloatArray, samples: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rotation vector phi (rad), plain velocity increment, and the compensated one in the axes of the start (m/s)."""
    if samples == 1:
        phi, dvel = sample[..., 1:4], sample[..., 4:7]
        return phi, dvel, dvel + 0.5 * _times(skew(phi), dvel)
    theta_1, dvel_1, theta_2, dvel_2 = np.moveaxis(sample[..., 1:].reshape((*sample.shape[:-1], 4, 3)), -2, 0)
    theta, dvel, first = theta_1 + theta_2, dvel_1 + dvel_2, skew(theta_1)
    sculling = _times(first, dvel_2) - _times(skew(theta_2), dvel_1)
    push = dvel + 0.5 * _times(skew(theta), dvel) + 2.0 / 3.0 * sculling
    return theta + 2.0 / 3.0 * _times(first, theta_2), dvel, push


def rates(place: FloatArray, V: FloatArray, on: Switches) -> tuple[FloatArray, FloatArray]:
    """omega_ie_n and the computed omega_en_n, (..., 3) rad/s."""
    earth = np.zeros(V.shape)
    earth[..., 1:] = place[..., :2]
    transport = np.zeros(V.shape)
    if on.transport_rate:
        transport[..., 0] = -V[..., 1] / place[..., 3]
        transport[..., 1] = V[..., 0] / place[..., 4]
        transport[..., 2] = transport[..., 1] * place[..., 5]
    return earth, transport


def row_of(
    C: FloatArray, force_n: FloatArray, rate_n: FloatArray, V: FloatArray, place: FloatArray, on: Switches
) -> FloatArray:
    """A nominal row (..., 25) from C_bn, f_n, omega_nb_n, V_n and the place."""
    parts = (C.reshape((*C.shape[:-2], 9)), force_n, rate_n, V, *rates(place, V, on), place[..., 2:3])
    return np.concatenate(parts, axis=-1)


def switches(params: FloatArray) -> Switches:
    """``params``, unpacked."""
    samples, coriolis, transport, position, vertical, point = params[:6]
    return Switches(int(samples), coriolis > 0, transport > 0, position > 0, vertical > 0, float(point), params[6:])


def _place_of(state: FloatArray, on: Switches) -> FloatArray:
    if on.position_update:
        return place_at(state[..., 12], state[..., 14])
    return np.broadcast_to(on.place, (*state.shape[:-1], on.place.size))


def _moved(position: FloatArray, V_twice: FloatArray, dt: FloatArray, place: FloatArray) -> FloatArray:
    """Latitude, longitude, height after dt with the velocity V_twice / 2."""
    path = 0.5 * V_twice * dt[..., None]
    latitude = position[..., 0] + path[..., 1] / place[..., 3]
    between = 0.5 * (position[..., 0] + latitude)
    longitude = wrapped(position[..., 1] + path[..., 0] / (place[..., 4] * np.cos(between)))
    return np.stack([latitude, longitude, position[..., 2] + path[..., 2]], axis=-1)


def _times(A: FloatArray, v: FloatArray) -> FloatArray:
    """A v, summed from left to right as the compiled loop does, so that the two stay equal over a long run."""
    return A[..., 0] * v[..., 0, None] + A[..., 1] * v[..., 1, None] + A[..., 2] * v[..., 2, None]


def _product(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B, summed as `_times` does it."""
    return (
        A[..., 0, None] * B[..., None, 0, :]
        + A[..., 1, None] * B[..., None, 1, :]
        + A[..., 2, None] * B[..., None, 2, :]
    )
