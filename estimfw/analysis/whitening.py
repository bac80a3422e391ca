"""Coordinates in which the prior is the identity, so that units play no part: x = L u with P0 = L L^T."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["prior_root", "whitening"]

FloatArray = NDArray[np.float64]

#: Smallest eigenvalue of a correlation matrix, so that a whitening can be inverted.
SMALLEST = 1e-12


def whitening(covariance: FloatArray) -> FloatArray:
    """L (n, n), invertible; a state with zero prior sigma counts with sigma 1 in its unit."""
    return _root(covariance, zero=1.0, smallest=SMALLEST)


def prior_root(covariance: FloatArray) -> FloatArray:
    """L (n, n) with L L^T = covariance as it is: zero rows where the prior sigma is zero."""
    return _root(covariance, zero=0.0, smallest=0.0)


def _root(covariance: FloatArray, *, zero: float, smallest: float) -> FloatArray:
    sigma = np.sqrt(np.diag(covariance))
    known = sigma == 0.0
    unit = np.where(known, 1.0, sigma)
    correlation = covariance / np.outer(unit, unit)
    np.fill_diagonal(correlation, 1.0)
    half = np.eye(len(sigma))
    if not np.array_equal(correlation, half):
        values, vectors = np.linalg.eigh(correlation)
        half = vectors * np.sqrt(np.clip(values, smallest, None))
    return np.asarray(np.where(known, zero, unit)[:, None] * half)
