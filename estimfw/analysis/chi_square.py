"""Quantiles and bounds of chi-square, from the special function: `scipy.stats` takes half a second to load."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaincinv

__all__ = ["mean_bounds", "quantile"]

FloatArray = NDArray[np.float64]


def quantile(probability: float, freedom: ArrayLike) -> FloatArray:
    """What a chi-square variable with ``freedom`` degrees (N,) stays below with this probability, (N,).

    Each distinct number of degrees is computed once; they need not be whole.
    """
    distinct, place = np.unique(np.asarray(freedom, dtype=np.float64), return_inverse=True)
    return np.asarray(2 * gammaincinv(distinct / 2, probability), dtype=np.float64)[place]


def mean_bounds(confidence: float, freedom: ArrayLike) -> FloatArray:
    """Two-sided bounds (N, 2) of (chi-square / degrees) for ``freedom`` degrees (N,): around 1; NaN without any degree.

    The mean of n independent NEES or NIS of d degrees lies within d times the bounds for n d degrees.
    """
    degrees = np.atleast_1d(np.asarray(freedom, dtype=np.float64))
    known = np.where(degrees > 0.0, degrees, np.nan)
    return np.stack([quantile(0.5 * (1.0 + sign * confidence), known) / known for sign in (-1.0, 1.0)], axis=-1)
