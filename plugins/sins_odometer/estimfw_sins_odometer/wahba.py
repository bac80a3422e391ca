r"""Wahba's problem of vectors that come one after the other, by Davenport's matrix (A5).

With ``[v +]`` and ``[v -]`` the matrices of a quaternion product with (0, v) from the left and from the right, the sum of
``([beta +] - [alpha -])^T ([beta +] - [alpha -]) dt`` is K with ``q^T K q = sum abs(beta - C alpha)^2 dt``; the best q is the
eigenvector of its smallest eigenvalue. Vectors are not normalised: long ones, which say more, weigh more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["best_rotation", "davenport"]

FloatArray = NDArray[np.float64]


def davenport(beta: FloatArray, alpha: FloatArray) -> FloatArray:
    """([beta +] - [alpha -])^T ([beta +] - [alpha -]), (..., 4, 4), of vectors (..., 3)."""
    difference, total = beta - alpha, beta + alpha
    M = np.zeros((*difference.shape[:-1], 4, 4))
    M[..., 0, 1:], M[..., 1:, 0] = -difference, difference
    x, y, z = (total[..., i] for i in range(3))
    M[..., 1, 2], M[..., 1, 3], M[..., 2, 1] = -z, y, z
    M[..., 2, 3], M[..., 3, 1], M[..., 3, 2] = -x, -y, x
    return np.asarray(np.swapaxes(M, -1, -2) @ M)


def best_rotation(K: FloatArray) -> tuple[FloatArray, FloatArray]:
    """C (..., 3, 3) with beta = C alpha, and the smallest eigenvalue (...), of K (..., 4, 4)."""
    values, vectors = np.linalg.eigh(K)
    w, x, y, z = (vectors[..., i, 0] for i in range(4))
    rows = [
        w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
        2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z,
    ]  # fmt: skip
    C = np.stack(rows, axis=-1)
    return C.reshape((*w.shape, 3, 3)), values[..., 0]
