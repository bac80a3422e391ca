"""Wahba's problem: the rotation that best turns one set of vectors into another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw_inertial.rotation import skew

__all__ = ["davenport"]

FloatArray = NDArray[np.float64]


def davenport(reference: FloatArray, observed: FloatArray, weight: FloatArray | None = None) -> FloatArray:
    """The proper rotation C (3, 3) with the least sum of weight * abs(reference - C observed)^2.

    Parameters
    ----------
    reference, observed : (N, 3) array
        Of any length: a long vector counts by its square, as is right where its noise does not grow with it.
    weight : (N,) array, optional
        Ones if None.

    Notes
    -----
    Davenport's q-method: the quaternion is the eigenvector of the largest eigenvalue of K (Wertz, *Spacecraft Attitude
    Determination and Control*, 1978, 12.2).
    """
    weighted = reference if weight is None else reference * weight[:, None]
    B = weighted.T @ observed
    K = np.empty((4, 4))
    K[:3, :3] = B + B.T - np.trace(B) * np.eye(3)
    K[:3, 3] = K[3, :3] = [B[1, 2] - B[2, 1], B[2, 0] - B[0, 2], B[0, 1] - B[1, 0]]
    K[3, 3] = np.trace(B)
    vector, scalar = np.split(np.linalg.eigh(K)[1][:, -1], [3])
    turn = skew(vector)
    C: FloatArray = np.eye(3) - 2.0 * float(scalar[0]) * turn + 2.0 * turn @ turn
    return C
