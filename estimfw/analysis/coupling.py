"""How strongly states drive each other along a run: the physical coupling, which no measurement has mixed yet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["coupling"]

FloatArray = NDArray[np.float64]


def coupling(mean_transition: FloatArray, sigma: FloatArray) -> FloatArray:
    """The part of each sigma that another state moves in one step: |Phi_ij| sigma_j / sigma_i, both ways added up.

    Parameters
    ----------
    mean_transition : (n, n) array
        Mean of |Phi| over the steps of the run.
    sigma : (n,) array
        Of the converged covariance. A state without variance drives nothing and is driven by nothing.

    Returns
    -------
    (n, n) array
        Symmetric, zero on the diagonal.
    """
    scale = np.divide(1.0, sigma, out=np.zeros_like(sigma), where=sigma > 0.0)
    driven = np.abs(mean_transition) * scale[:, None] * sigma
    np.fill_diagonal(driven, 0.0)
    return np.asarray(driven + driven.T)
