"""Mean and sum of squared deviations over runs, from parts: merged in a fixed order they are the same to the last bit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Moments"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Moments:
    """Of ``count`` runs: ``mean`` (...) and ``deviation`` (...), the sum of squared deviations from it."""

    count: int
    mean: FloatArray
    deviation: FloatArray

    @classmethod
    def of(cls, values: FloatArray) -> Moments:
        """Over the first axis of (R, ...)."""
        mean = np.mean(values, axis=0)
        return cls(values.shape[0], mean, np.sum(np.square(values - mean), axis=0))

    def merged(self, other: Moments) -> Moments:
        """Of both together (Chan, Golub, LeVeque, *The American Statistician* 37 (1983) 242)."""
        count = self.count + other.count
        apart = other.mean - self.mean
        mean = self.mean + apart * (other.count / count)
        return Moments(
            count, mean, self.deviation + other.deviation + np.square(apart) * (self.count * other.count / count)
        )

    @classmethod
    def merge(cls, parts: Iterable[Moments]) -> Moments:
        """All parts, from the first to the last."""
        parts = iter(parts)
        total = next(parts)
        for part in parts:
            total = total.merged(part)
        return total

    @property
    def spread(self) -> FloatArray:
        """Standard deviation over the runs; NaN of a single one."""
        if self.count < 2:
            return np.full(self.mean.shape, np.nan)
        return np.asarray(np.sqrt(self.deviation / (self.count - 1)))

    @property
    def rms(self) -> FloatArray:
        """Root of the mean square."""
        return np.asarray(np.sqrt(np.square(self.mean) + self.deviation / self.count))
