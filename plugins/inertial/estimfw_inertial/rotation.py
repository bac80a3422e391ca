"""Rotations as arrays with leading axes: rotation vectors, matrices, and the angles yaw, pitch, roll."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "attitude_matrix",
    "euler_angles",
    "euler_jacobian",
    "exponential",
    "heading_of",
    "logarithm",
    "skew",
    "wrapped",
]

FloatArray = NDArray[np.float64]


#: [v x] flattened is v @ this.
_SKEW = np.array([
    [0, 0, 0, 0, 0, -1, 0, 1, 0],
    [0, 0, 1, 0, 0, 0, -1, 0, 0],
    [0, -1, 0, 1, 0, 0, 0, 0, 0],
], dtype=float)  # fmt: skip
_IDENTITY = np.eye(3)


def skew(vector: ArrayLike) -> FloatArray:
    """[v x], (..., 3, 3), of v (..., 3)."""
    v = np.asarray(vector, dtype=float)
    return np.asarray((v @ _SKEW).reshape((*v.shape, 3)))


def exponential(vector: ArrayLike) -> FloatArray:
    """exp([v x]), (..., 3, 3), of a rotation vector v (..., 3) in rad.

    Rodrigues' formula in half angles, right to the last digits however small the angle: with t = abs(v) and
    k = sin(t / 2) / t it is ``I + 2 k cos(t / 2) [v x] + 2 k^2 [v x]^2``.
    """
    v = np.asarray(vector, dtype=float)
    angle = np.sqrt(np.sum(v * v, axis=-1))[..., None, None]
    still = angle == 0.0
    k = np.where(still, 0.5, np.sin(0.5 * angle) / np.where(still, 1.0, angle))
    cross = skew(v)
    return np.asarray(_IDENTITY + 2.0 * k * np.cos(0.5 * angle) * cross + 2.0 * k * k * (cross @ cross))


def logarithm(rotation: ArrayLike) -> FloatArray:
    """The rotation vector v (..., 3), at most pi long, with exp([v x]) the given matrix (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    C = np.asarray(rotation, dtype=float)
    return np.asarray(Rotation.from_matrix(C.reshape((-1, 3, 3))).as_rotvec().reshape((*C.shape[:-2], 3)))


def attitude_matrix(yaw: ArrayLike, pitch: ArrayLike, roll: ArrayLike) -> FloatArray:
    """C_bn = Rz(yaw) Rx(pitch) Ry(roll), (..., 3, 3), of angles (...) in rad."""
    sy, sp, sr = np.sin(yaw), np.sin(pitch), np.sin(roll)
    cy, cp, cr = np.cos(yaw), np.cos(pitch), np.cos(roll)
    rows = [
        cy * cr - sy * sp * sr, -sy * cp, cy * sr + sy * sp * cr,
        sy * cr + cy * sp * sr, cy * cp, sy * sr - cy * sp * cr,
        -cp * sr, sp, cp * cr,
    ]  # fmt: skip
    stacked = np.stack(np.broadcast_arrays(*rows), axis=-1)
    return np.asarray(stacked.reshape((*stacked.shape[:-1], 3, 3)))


def euler_angles(C_bn: ArrayLike) -> FloatArray:
    """yaw, pitch, roll in rad, (..., 3), of C_bn (..., 3, 3): yaw and roll in -pi .. pi, pitch in -pi/2 .. pi/2.

    With the nose straight up or down only yaw plus or minus roll is defined, and how it is shared out is arbitrary.
    """
    C = np.asarray(C_bn, dtype=float)
    yaw = np.arctan2(-C[..., 0, 1], C[..., 1, 1])
    pitch = np.arctan2(C[..., 2, 1], np.hypot(C[..., 0, 1], C[..., 1, 1]))
    roll = np.arctan2(-C[..., 2, 0], C[..., 2, 2])
    return np.stack([yaw, pitch, roll], axis=-1)


def euler_jacobian(C_bn: ArrayLike) -> FloatArray:
    """d(yaw, pitch, roll)/d(phi), (..., 3, 3), of C_bn (..., 3, 3) turned by a small phi in n from the left.

    With dC = [phi x] C and c^2 = C01^2 + C11^2 = 1 - C21^2::

        d yaw   = phi_U - C21 (C01 phi_E + C11 phi_N) / c^2
        d pitch = (C11 phi_E - C01 phi_N) / c
        d roll  = (C01 phi_E + C11 phi_N) / c^2
    """
    C = np.asarray(C_bn, dtype=float)
    c01, c11, c21 = C[..., 0, 1], C[..., 1, 1], C[..., 2, 1]
    c2 = np.maximum(c01**2 + c11**2, 1e-12)
    c = np.sqrt(c2)
    zero, one = np.zeros_like(c), np.ones_like(c)
    yaw = np.stack([-c21 * c01 / c2, -c21 * c11 / c2, one], axis=-1)
    pitch = np.stack([c11 / c, -c01 / c, zero], axis=-1)
    roll = np.stack([c01 / c2, c11 / c2, zero], axis=-1)
    return np.stack([yaw, pitch, roll], axis=-2)


def heading_of(yaw: ArrayLike) -> FloatArray:
    """Heading, clockwise from North in 0 .. 2 pi, of a yaw in rad; the same rule takes a heading back to a yaw, see `wrapped`."""
    heading = np.mod(-np.asarray(yaw, dtype=float), 2.0 * np.pi)
    return np.where(heading >= 2.0 * np.pi, 0.0, heading)


def wrapped(angle: ArrayLike) -> FloatArray:
    """The angle in -pi .. pi (rad), -pi excluded: ``yaw = wrapped(-heading)``."""
    return np.asarray(np.pi - np.mod(np.pi - np.asarray(angle, dtype=float), 2.0 * np.pi))
