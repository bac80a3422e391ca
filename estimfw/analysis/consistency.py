r"""Is a filter as good as it says? Squared errors in units of its own covariance, over many independent runs.

For a consistent filter the normalised estimation error squared (NEES) ``e' P^-1 e`` of d states, and the normalised
innovation squared (NIS) of d rows, are chi-square with d degrees, mean d [1].

Neighbouring instants of one run are correlated (NEES strongly), runs are not. So each run gives one number, its mean over
time a_r, and these R independent numbers are judged: their mean is d, and its scatter is taken from the runs themselves.
Matching a gamma distribution, the mean is that of

    n = 2 mean(a)^2 / (d var(a) / R)

independent chi-square numbers, the effective sample size; it does not change if all a_r are scaled, so a filter that is wrong by
a factor does not hide behind its own scatter. The bounds are those of chi-square with n d degrees, taken as much wider as
Student's t with R - 1 degrees is against the normal distribution, because the scatter was estimated. At the last instant the
runs are independent as they are: R d degrees.

Several quantities are judged at once, T tests in all: each at the level confidence^(1/T) (Sidak), so that a consistent filter
passes all of them with the asked confidence. The share of instants outside the bounds of one instant is told, not judged:
instants are correlated.

[1] Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation* (2001), section 5.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtrit

from estimfw.analysis.chi_square import mean_bounds

__all__ = ["Judged", "at_one_instant", "effective_samples", "level_of_each", "over_time", "share_outside"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Judged:
    """A mean of chi-square numbers of ``freedom`` degrees, and its bounds; ``samples`` independent ones are behind it."""

    mean: float
    low: float
    high: float
    samples: float

    @property
    def inside(self) -> bool:
        return bool(self.low <= self.mean <= self.high)

    @property
    def verdict(self) -> str:
        if self.inside:
            return "consistent"
        return "sigmas too small" if self.mean > self.high else "sigmas too large"


def level_of_each(confidence: float, tests: int) -> float:
    """Confidence of each of so many tests, of which all pass with ``confidence``."""
    return float(confidence ** (1.0 / max(1, tests)))


def effective_samples(per_run: FloatArray, freedom: float) -> float:
    """Number of independent chi-square numbers of ``freedom`` degrees whose mean scatters as that of ``per_run`` (R,)."""
    mean, variance = float(np.mean(per_run)), float(np.var(per_run, ddof=1))
    if variance <= 0.0:
        return float("inf")
    return 2.0 * mean**2 * per_run.size / (freedom * variance)


def over_time(per_run: FloatArray, freedom: float, level: float) -> Judged:
    """The mean over time and runs, from each run's mean over time (R,), R > 1."""
    samples = effective_samples(per_run, freedom)
    mean = float(np.mean(per_run))
    if not np.isfinite(samples):
        return Judged(mean, freedom, freedom, samples)
    wider = float(ndtr(stdtrit(per_run.size - 1, 0.5 * (1.0 + level))))
    low, high = freedom * mean_bounds(2.0 * wider - 1.0, samples * freedom)[0]
    return Judged(mean, float(low), float(high), samples)


def at_one_instant(values: FloatArray, freedom: float, level: float) -> Judged:
    """The mean of R independent runs at one instant, (R,)."""
    low, high = freedom * mean_bounds(level, values.size * freedom)[0]
    return Judged(float(np.mean(values)), float(low), float(high), float(values.size))


def share_outside(mean: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Share of the instants (T,) with a mean outside the bounds of one instant; NaN where there is none."""
    known = np.isfinite(mean) & np.isfinite(low)
    return float(np.mean((mean < low)[known] | (mean > high)[known])) if np.any(known) else float("nan")
