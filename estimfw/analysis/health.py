"""Whether measurement and filter still agree: rejections in a row, and the mean NIS of the last epochs.

Both are judged along a run, stretch after stretch: ``advance`` takes the next epochs and returns the judge as it is after them,
so that a judge is a value which can be kept and gone back to.

Where there is a gate, an NIS counts for no more than what 99 % stay below: a few outliers, however large, are no divergence, and
there is another judge for those in a row.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.chi_square import quantile
from estimfw.data.record import SAME
from estimfw.kernels.fuse import FUSED, GATED

__all__ = [
    "CAUTIOUS",
    "DEGRADED",
    "DIVERGED",
    "NisJudge",
    "NisJudged",
    "NisLimit",
    "RejectionJudge",
    "RejectionLimit",
    "Spell",
]

Bools = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

DEGRADED, DIVERGED, CAUTIOUS = "health degraded", "divergence", "too cautious"
"""Kinds of the events that tell it."""


@dataclass(frozen=True, slots=True)
class Spell:
    """For each of K epochs: how many up to it are marked in a row, and since when (s; NaN where it is not marked)."""

    count: IntArray
    since: FloatArray

    @classmethod
    def of(cls, marked: Bools, time: FloatArray, count: int, since: float) -> Spell:
        """``count`` epochs in a row, since ``since``, were marked before these (K,)."""
        if not marked.any():
            return cls(np.zeros(marked.size, dtype=np.int64), np.full(marked.size, np.nan))
        index = np.arange(marked.size)
        broken = np.maximum.accumulate(np.where(marked, -1, index))
        number = np.where(marked, index - broken + np.where(broken < 0, count, 0), 0)
        own = time[np.minimum(broken + 1, marked.size - 1)]
        begin = np.where((broken < 0) & (count > 0), since, own)
        return cls(number.astype(np.int64), np.where(marked, begin, np.nan))

    @property
    def last(self) -> tuple[int, float]:
        """Count and begin at the last epoch."""
        return int(self.count[-1]), float(self.since[-1])


@dataclass(frozen=True, slots=True)
class RejectionLimit:
    """Rejected every time it was due: at least so many ``times`` in a row, and over ``longer`` s or more."""

    times: int
    longer: float = 0.0


@dataclass(frozen=True, slots=True)
class RejectionJudge:
    """Of one measurement: ``count`` rejections in a row, since ``since`` (s)."""

    limit: RejectionLimit
    count: int = 0
    since: float = float("nan")

    def advance(self, time: FloatArray, disposition: IntArray) -> tuple[RejectionJudge, Bools, FloatArray]:
        """Which of the next epochs (K,) are degraded, and since when each (s); epochs without a usable reading do not count."""
        known = np.flatnonzero((disposition == FUSED) | (disposition == GATED))
        spell = Spell.of(disposition[known] == GATED, time[known], self.count, self.since)
        degraded, since = np.zeros(time.size, dtype=bool), np.full(time.size, np.nan)
        long = time[known] - spell.since >= self.limit.longer - SAME
        degraded[known], since[known] = (spell.count >= self.limit.times) & long, spell.since
        if not known.size:
            return self, degraded, since
        count, begin = spell.last
        return replace(self, count=count, since=begin), degraded, since

    def anew(self) -> RejectionJudge:
        """After something was done about it."""
        return RejectionJudge(self.limit)


@dataclass(frozen=True, slots=True)
class NisLimit:
    """The mean NIS of the last ``epochs`` is out of the bounds of this ``probability`` over ``longer`` s or more."""

    epochs: int
    probability: float
    longer: float = 0.0


@dataclass(frozen=True, slots=True)
class NisJudge:
    """Of one measurement.

    Attributes
    ----------
    limit : NisLimit
    most : (rows + 1,) array or None
        What an NIS counts for at most, by the number of components; None: for what it is.
    nis, freedom : (M,) array
        Of the last epochs, fewer than the limit's.
    good : float, s
        The last epoch that was within bounds; NaN: none yet.
    high, low : tuple of int and float
        Epochs out of bounds in a row, and since when.
    """

    limit: NisLimit
    most: FloatArray | None = None
    nis: FloatArray = field(default_factory=lambda: np.zeros(0))
    freedom: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    good: float = float("nan")
    high: tuple[int, float] = (0, float("nan"))
    low: tuple[int, float] = (0, float("nan"))

    def advance(self, time: FloatArray, nis: FloatArray, freedom: IntArray) -> tuple[NisJudge, NisJudged]:
        """The next epochs (K,); NaN where there was no NIS."""
        known = np.flatnonzero(np.isfinite(nis) & (freedom > 0))
        if not known.size:
            return self, NisJudged.nothing(time.size)
        new = nis[known]
        if self.most is not None:
            new = np.minimum(new, self.most[np.minimum(freedom[known], self.most.size - 1)])
        all_nis, all_freedom = np.concatenate([self.nis, new]), np.concatenate([self.freedom, freedom[known]])
        total, degrees = (_windowed(x, self.limit.epochs)[-known.size :] for x in (all_nis, all_freedom))
        full = np.arange(all_nis.size)[-known.size :] >= self.limit.epochs - 1
        above = full & (total > _bounds(self.limit.probability, degrees))
        below = full & (total < _bounds(1.0 - self.limit.probability, degrees))
        high, low = (Spell.of(out, time[known], *before) for out, before in ((above, self.high), (below, self.low)))
        within = np.flatnonzero(full & ~(above | below))
        good = float(time[known][within[-1]]) if within.size else self.good
        keep = self.limit.epochs - 1
        kept = replace(self, nis=all_nis[-keep:], freedom=all_freedom[-keep:], good=good, high=high.last, low=low.last)
        return kept, NisJudged.spread(time, known, total / degrees, high, low, self.limit.longer)

    def anew(self) -> NisJudge:
        """After something was done about it: the epochs before say nothing of those that come."""
        return NisJudge(self.limit, self.most, good=self.good)


@dataclass(frozen=True, slots=True)
class NisJudged:
    """Of K epochs.

    Attributes
    ----------
    high, low : (K,) bool array
        The mean NIS has been too large, or too small, for long enough.
    high_since, low_since : (K,) array, s
        Since when; NaN where it is not.
    ratio : (K,) array
        The mean over its expectation; NaN where there is none.
    """

    high: Bools
    low: Bools
    high_since: FloatArray
    low_since: FloatArray
    ratio: FloatArray

    @classmethod
    def nothing(cls, count: int) -> NisJudged:
        """No epoch had an NIS."""
        no, never = np.zeros(count, dtype=bool), np.full(count, np.nan)
        return cls(no, no, never, never, never)

    @classmethod
    def spread(
        cls, time: FloatArray, known: IntArray, ratio: FloatArray, high: Spell, low: Spell, longer: float
    ) -> NisJudged:
        """What is known of some epochs, among all."""
        flags, times = np.zeros((2, time.size), dtype=bool), np.full((3, time.size), np.nan)
        for i, spell in enumerate((high, low)):
            flags[i, known] = (spell.count > 0) & (time[known] - spell.since >= longer - SAME)
            times[i, known] = spell.since
        times[2, known] = ratio
        return cls(flags[0], flags[1], times[0], times[1], times[2])


def most_counted(thresholds: FloatArray | None) -> FloatArray | None:
    """What an NIS counts for at most (rows + 1,), of a measurement with these gates; None: it has none."""
    if thresholds is None:
        return None
    counted = np.concatenate([[0.0], quantile(0.99, np.arange(1, thresholds.size))])
    return np.asarray(np.minimum(thresholds, counted))


def _bounds(probability: float, degrees: FloatArray) -> FloatArray:
    """Quantiles (K,); the same few degrees come again and again, step by step in a session."""
    if degrees.size == 1:
        return np.array([_bound(probability, float(degrees[0]))])
    return quantile(probability, degrees)


@lru_cache(maxsize=4096)
def _bound(probability: float, degrees: float) -> float:
    return float(quantile(probability, [degrees])[0])


def _windowed(x: NDArray[np.float64] | IntArray, width: int) -> FloatArray:
    """Sum of each and those before it, of so many in all."""
    total = np.cumsum(np.concatenate([[0.0], x]))
    end = np.arange(1, x.size + 1)
    return np.asarray(total[end] - total[np.maximum(end - width, 0)])
