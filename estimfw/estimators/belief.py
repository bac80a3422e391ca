"""What is believed when a stage begins: which covariance goes on, and what is kept of states that are held meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Belief"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Belief:
    """A covariance and what stands beside it.

    Attributes
    ----------
    covariance : (n, n) array
        Zero in the rows and columns of held states.
    kept : (n, n) array
        Of held states the covariance that they enter with when they are estimated: that of the prior, or what they had when they
        were held. States that were held at one time keep their correlations with each other.
    held : (n,) bool array
    """

    covariance: FloatArray
    kept: FloatArray
    held: BoolArray

    @classmethod
    def before_all(cls, prior: FloatArray) -> Belief:
        """Before the first stage: nothing is estimated yet, and each state will enter with its prior (n, n)."""
        return cls(np.zeros_like(prior), prior.copy(), np.ones(prior.shape[-1], dtype=bool))

    def changed(self, held: BoolArray) -> Belief:
        """When a stage begins in which these states (n,) are held.

        A state that is estimated from now on is uncorrelated with those that were estimated before: of what the errors have in
        common with it nothing was followed meanwhile.
        """
        covariance, kept = self.covariance.copy(), self.kept.copy()
        leaving, entering = held & ~self.held, self.held & ~held
        kept[leaving, :] = kept[:, leaving] = 0.0
        kept[np.ix_(leaving, leaving)] = covariance[np.ix_(leaving, leaving)]
        for gone in (leaving, entering):
            covariance[gone, :] = covariance[:, gone] = 0.0
        covariance[np.ix_(entering, entering)] = kept[np.ix_(entering, entering)]
        return Belief(covariance, kept, held)
