"""Quantiles of chi-square, from the special function: `scipy.stats` takes half a second to load."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaincinv

from estimfw.data.record import FloatArray

__all__ = ["quantile"]


def quantile(probability: float, freedom: ArrayLike) -> FloatArray:
    """What a chi-square variable with ``freedom`` degrees (N,) stays below with this probability, (N,).

    Each distinct number of degrees is computed once; they need not be whole.
    """
    distinct, place = np.unique(np.asarray(freedom, dtype=np.float64), return_inverse=True)
    return np.asarray(2 * gammaincinv(distinct / 2, probability), dtype=np.float64)[place]
