"""What the mean of a record tells of a vehicle that stands: up, the Earth's rate, and how well the mean is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimfw.data.record import FloatArray

__all__ = ["StandingMeans"]

#: Parts of a record whose means are compared, for the error of the whole mean: right for noise that is not white too.
_PARTS = 10


@dataclass(frozen=True, slots=True)
class StandingMeans:
    """Means of a standing record.

    Attributes
    ----------
    force_b : (3,) array, m/s^2
    rate_b : (3,) array, rad/s
    period : float, s
    vertical_sigma : float, rad/s
        Standard error of the mean rate along the specific force; infinite where the record is too short to tell.
    """

    force_b: FloatArray
    rate_b: FloatArray
    period: float
    vertical_sigma: float = float("inf")

    @classmethod
    def of(cls, values: FloatArray, period: float) -> StandingMeans:
        """Means of increments (N, 6), rad and m/s, over ``period`` s each; NaN is left out."""
        mean = np.nanmean(values, axis=0) / period
        return cls(mean[3:6], mean[:3], period, _standard_error(values[:, :3] @ _unit(mean[3:6])) / period)

    @property
    def up_b(self) -> FloatArray:
        """Unit vector (3,) of the specific force."""
        return _unit(self.force_b)

    @property
    def vertical_rate(self) -> float:
        """Mean rate along the specific force, rad/s."""
        return float(self.rate_b @ self.up_b)

    @property
    def sine_of_latitude(self) -> float:
        """What the angle between rate and specific force says of it; 0 without a rate."""
        size = float(np.linalg.norm(self.rate_b))
        return self.vertical_rate / size if size > 0.0 else 0.0


def _unit(vector: FloatArray) -> FloatArray:
    size = float(np.linalg.norm(vector))
    return np.asarray(vector / size if size > 0.0 else vector, dtype=float)


def _standard_error(series: FloatArray) -> float:
    """Of the mean of a series (N,), from the means of its parts."""
    good = series[np.isfinite(series)]
    length = good.size // _PARTS
    if length < 2:
        return float("inf")
    means = good[: length * _PARTS].reshape(_PARTS, length).mean(axis=1)
    return float(np.std(means, ddof=1) / np.sqrt(_PARTS))
