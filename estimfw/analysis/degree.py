"""The degree of each state: how much of its prior sigma is left, of all of it and of its observable part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Degrees", "observable_part", "posterior_over_prior"]

FloatArray = NDArray[np.float64]

#: A state of which less than this (of its prior sigma) lies in the observable part has none.
NONE = 1e-7


@dataclass(frozen=True, slots=True)
class Degrees:
    """Over T instants and n states: posterior sigma over prior sigma, and the same of the observable part of each state.

    ``time`` (T,) in s; ``posterior`` and ``observable_part`` (T, n), NaN where a state has no prior sigma, or no such part.
    """

    time: FloatArray
    posterior: FloatArray
    observable_part: FloatArray


def posterior_over_prior(covariance: FloatArray, prior: FloatArray) -> FloatArray:
    """(n,), NaN where the prior sigma is zero."""
    return _ratio(np.sqrt(np.clip(np.diag(covariance), 0.0, None)), np.sqrt(np.diag(prior)))


def observable_part(covariance: FloatArray, unseen: FloatArray, root: FloatArray) -> FloatArray:
    """The degree of each state once the unobservable directions are projected out, (n,).

    With x = L u (P0 = L L^T) the projector onto what is orthogonal to the unobservable directions in u; both sigmas are of the
    projected state. A state that would be known but for an unobservable direction is small here.

    Parameters
    ----------
    covariance : (n, n) array
        Posterior.
    unseen : (n, k) array
        Unobservable directions at that time, in x.
    root : (n, n) array
        L, invertible.
    """
    inverse = np.linalg.inv(root)
    lengths = np.linalg.norm(inverse @ unseen, axis=0)
    basis = np.linalg.qr(inverse @ unseen / np.where(lengths > 0.0, lengths, 1.0))[0]
    part = root - root @ basis @ basis.T
    open_sigma = np.linalg.norm(part, axis=1)
    known = open_sigma > NONE * np.linalg.norm(root, axis=1)
    left = part @ inverse
    sigma = np.sqrt(np.clip(np.einsum("ij,jk,ik->i", left, covariance, left), 0.0, None))
    return _ratio(sigma, np.where(known, open_sigma, 0.0))


def _ratio(above: FloatArray, below: FloatArray) -> FloatArray:
    known = below > 0.0
    return np.where(known, above / np.where(known, below, 1.0), np.nan)
