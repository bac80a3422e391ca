"""Sigma points of the scaled unscented transform (Julier and Uhlmann 2004; weights as Wan and van der Merwe 2000)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Spread"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Spread:
    """How far points lie from the mean, and what the middle one weighs.

    ``lambda = alpha^2 (n + kappa) - n``; the points are the mean and, along each column of a square root of the covariance,
    ``sqrt(n + lambda)`` times that column to both sides. With alpha 1 and kappa 0 they are those of the cubature rule, all
    weights are positive, and beta 2 gives the middle one the part in the covariance that is right to fourth order for a normal
    variable.
    """

    alpha: float = 1.0
    beta: float = 2.0
    kappa: float = 0.0

    def points(self, mean: FloatArray, root: FloatArray) -> FloatArray:
        """(2 n + 1, n): the mean first; ``root`` (n, n) has the covariance root root'."""
        n = mean.shape[0]
        aside = self.alpha * np.sqrt(n + self.kappa) * root.T
        return np.concatenate([mean[None], mean + aside, mean - aside])

    def weights(self, n: int) -> tuple[FloatArray, FloatArray]:
        """Of the points in the mean and in the covariance, (2 n + 1,) each."""
        total = self.alpha**2 * (n + self.kappa)
        in_mean = np.full(2 * n + 1, 0.5 / total)
        in_mean[0] = (total - n) / total
        in_covariance = in_mean.copy()
        in_covariance[0] += 1.0 - self.alpha**2 + self.beta
        return in_mean, in_covariance
