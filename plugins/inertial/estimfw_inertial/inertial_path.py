"""What an IMU alone tells of its own motion: attitude and velocity in the inertial frame ``b0``, the body axes at the start.

No place, no gravity and no Earth come in, so the result is the same wherever the vehicle stands. The attitude is a running
product of rotations, taken in blocks (a loop over the square root of the length).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["inertial_path", "running_product"]

FloatArray = NDArray[np.float64]


def inertial_path(dtheta: FloatArray, dvel: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Attitude and velocity increments in the frozen body axes of the start.

    Parameters
    ----------
    dtheta : (N, 3) array, rad
        Gyro increments, in b.
    dvel : (N, 3) array, m/s
        Accelerometer increments, in b.

    Returns
    -------
    C : (N + 1, 3, 3) array
        Takes a vector from b at the end of step k to b0; the first is the identity.
    dvel_b0 : (N, 3) array, m/s
        Integral of specific force over each step, in b0.

    Notes
    -----
    Coning and sculling are compensated with the increments of the step before, rotation by half the turn of the step
    (Savage, *J. Guid. Control Dyn.* 21, 1998, parts 1 and 2).
    """
    before_theta = np.concatenate([np.zeros((1, 3)), dtheta[:-1]])
    before_vel = np.concatenate([np.zeros((1, 3)), dvel[:-1]])
    turn = dtheta + np.cross(before_theta, dtheta) / 12.0
    attitude = np.concatenate([[[1.0, 0.0, 0.0, 0.0]], running_product(_quaternion(turn))])
    C = _matrix(attitude)
    sculling = (np.cross(before_theta, dvel) + np.cross(before_vel, dtheta)) / 12.0
    push = dvel + 0.5 * np.cross(dtheta, dvel) + sculling
    return C, np.einsum("kij,kj->ki", C[:-1], push)


def running_product(q: FloatArray) -> FloatArray:
    """The products q_0, q_0 q_1, q_0 q_1 q_2 ... of unit quaternions (N, 4), scalar first."""
    count = q.shape[0]
    length = max(1, int(np.sqrt(count)))
    blocks = -(-count // length)
    padded = np.zeros((blocks * length, 4))
    padded[:, 0] = 1.0
    padded[:count] = q
    work = padded.reshape(blocks, length, 4)
    for k in range(1, length):
        work[:, k] = _product(work[:, k - 1], work[:, k])
    for k in range(1, blocks):
        work[k] = _product(work[k - 1, -1], work[k])
    product = work.reshape(-1, 4)[:count]
    return np.asarray(product / np.linalg.norm(product, axis=1, keepdims=True), dtype=float)


def _quaternion(vector: FloatArray) -> FloatArray:
    """Unit quaternions (..., 4), scalar first, of rotation vectors (..., 3) in rad."""
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.concatenate([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * vector], axis=-1)


def _product(p: FloatArray, q: FloatArray) -> FloatArray:
    pw, pv, qw, qv = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    scalar = pw * qw - np.sum(pv * qv, axis=-1, keepdims=True)
    return np.concatenate([scalar, pw * qv + qw * pv + np.cross(pv, qv)], axis=-1)


def _matrix(q: FloatArray) -> FloatArray:
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
        2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
    ]  # fmt: skip
    return np.stack(rows, axis=-1).reshape((*q.shape[:-1], 3, 3))
