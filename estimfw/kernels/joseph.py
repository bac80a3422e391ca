"""The covariance kept whole, updated in Joseph's form: the readable definition, and the oracle of the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["added", "covariance", "factor", "predict", "projected", "update"]

FloatArray = NDArray[np.float64]


def factor(P: FloatArray) -> FloatArray:
    """The form that the recursion carries: P itself, (..., n, n)."""
    return 0.5 * (P + np.swapaxes(P, -1, -2))


def covariance(form: FloatArray) -> FloatArray:
    return form


def predict(form: FloatArray, Phi: FloatArray, Q: FloatArray) -> FloatArray:
    """P <- Phi P Phi' + Q."""
    P = Phi @ form @ np.swapaxes(Phi, -1, -2) + Q
    return 0.5 * (P + np.swapaxes(P, -1, -2))


def projected(form: FloatArray, H: FloatArray) -> FloatArray:
    """H P H', (..., m, m)."""
    return H @ form @ np.swapaxes(H, -1, -2)


def update(form: FloatArray, h: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One scalar measurement.

    Parameters
    ----------
    form : (..., n, n) array
    h : (..., n) array
        Its row of H.
    r : (...) array
        Its variance.

    Returns
    -------
    form : (..., n, n) array
        P <- (I - K h) P (I - K h)' + K r K'.
    gain : (..., n) array
        Zero where the innovation variance is not positive.
    variance : (...) array
        Of the innovation, h P h' + r.
    """
    Ph = np.einsum("...ij,...j->...i", form, h)
    s = np.einsum("...i,...i->...", h, Ph) + r
    usable = s > 0.0
    K = np.where(usable[..., None], Ph / np.where(usable, s, 1.0)[..., None], 0.0)
    A = form - K[..., :, None] * Ph[..., None, :]
    Ah = np.einsum("...ij,...j->...i", A, h)
    P = A - Ah[..., :, None] * K[..., None, :] + np.asarray(r)[..., None, None] * K[..., :, None] * K[..., None, :]
    return 0.5 * (P + np.swapaxes(P, -1, -2)), K, s


def added(form: FloatArray, v: FloatArray, c: FloatArray) -> FloatArray:
    """P + c v v', for v (..., n) and c (...) not negative."""
    return np.asarray(form + np.asarray(c)[..., None, None] * v[..., :, None] * v[..., None, :])
