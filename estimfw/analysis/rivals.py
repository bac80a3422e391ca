"""Several filters over the same runs: how large their errors are, who is closer, and from when on they stay small."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["closer", "settled"]

FloatArray = NDArray[np.float64]


def closer(error: FloatArray, other: FloatArray) -> int:
    """In how many runs (R,) the first error is smaller than the second; unknown ones are none."""
    return int(np.count_nonzero(np.abs(error) < np.abs(other)))


def settled(time: FloatArray, error: FloatArray, bound: float) -> FloatArray:
    """From when on each run stays within a bound.

    Parameters
    ----------
    time : (T,) array
    error : (R, T) array
        Unknown errors are beyond the bound.
    bound : float

    Returns
    -------
    (R,) array
        The first instant of the last stretch within the bound; infinite where the run ends beyond it.
    """
    inside = np.abs(error) < bound
    stays = np.flip(np.logical_and.accumulate(np.flip(inside, axis=1), axis=1), axis=1)
    first = np.argmax(stays, axis=1)
    return np.where(stays[:, -1], time[first], np.inf)
