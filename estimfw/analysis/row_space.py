"""The observable row space, built a direction at a time, with the size that each direction had when it was judged.

A row is normalised before it is judged, and a direction before it goes on to the next derivative: couplings whose sizes differ
by ten decades stay apart, where the stacked matrix [H; H F; H F^2 ...] has lost them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["TOLERANCE", "RowSpace", "Spectrum"]

FloatArray = NDArray[np.float64]

#: A new direction whose part outside the known ones is smaller than this (of 1) counts as none.
TOLERANCE = 1e-9
#: A size within so many times the tolerance is near it.
NEAR = 1e3


@dataclass(frozen=True, slots=True)
class Spectrum:
    """How clear a rank is.

    Attributes
    ----------
    accepted : tuple of float
        For each direction found, in the order found, its part outside of those before it, of 1.
    rejected : tuple of float
        The same of those that counted as none, largest first.
    tolerance : float
    """

    accepted: tuple[float, ...]
    rejected: tuple[float, ...]
    tolerance: float = TOLERANCE

    @property
    def smallest_accepted(self) -> float:
        """1 where there is none."""
        return min(self.accepted, default=1.0)

    @property
    def largest_rejected(self) -> float:
        return max(self.rejected, default=0.0)

    @property
    def gap(self) -> float:
        """How many times larger the smallest kept is than the largest rejected."""
        return self.smallest_accepted / self.largest_rejected if self.largest_rejected else float("inf")

    @property
    def near_edge(self) -> bool:
        """A size within three decades of the tolerance: the rank hangs on it."""
        return self.smallest_accepted < NEAR * self.tolerance or self.largest_rejected > self.tolerance / NEAR

    def listed(self, states: int) -> list[float]:
        """One number a state: the accepted sizes, then the largest rejected ones (0 where nothing was left to judge)."""
        missing = states - len(self.accepted)
        return [*self.accepted, *(*self.rejected, *(0.0,) * missing)[:missing]]


class RowSpace:
    """A growing orthonormal basis of rows over ``size`` whitened states."""

    def __init__(self, size: int) -> None:
        self._basis = np.zeros((size, size))
        self.accepted: list[float] = []
        self._rejected: list[float] = []

    @property
    def rank(self) -> int:
        return len(self.accepted)

    @property
    def basis(self) -> FloatArray:
        """(rank, size), orthonormal rows in the order found."""
        return self._basis[: self.rank]

    @property
    def spectrum(self) -> Spectrum:
        return Spectrum(tuple(self.accepted), tuple(sorted(self._rejected, reverse=True)))

    @property
    def is_full(self) -> bool:
        return self.rank == self._basis.shape[0]

    def add(self, row: FloatArray) -> FloatArray | None:
        """The new direction that a row (size,) brings, or None."""
        length = float(np.linalg.norm(row))
        if self.is_full or length == 0.0:
            return None
        known = self.basis
        rest = row / length
        for _ in range(2):  # twice is enough (Kahan, in Parlett, The Symmetric Eigenvalue Problem, 1980)
            rest = rest - known.T @ (known @ rest)
        outside = float(np.linalg.norm(rest))
        if outside < TOLERANCE:
            self._rejected.append(outside)
            return None
        self.accepted.append(outside)
        self._basis[self.rank - 1] = rest / outside
        return np.asarray(self._basis[self.rank - 1])

    def add_derivatives(self, F: FloatArray, H: FloatArray) -> None:
        """The rows of H, H F, H F^2 ... with F (size, size) and H (m, size)."""
        waiting = list(H)
        while waiting and not self.is_full:
            direction = self.add(waiting.pop(0))
            if direction is not None:
                waiting.append(_onward(direction, F))


def _onward(direction: FloatArray, F: FloatArray) -> FloatArray:
    """direction @ F without what may be rounding of the direction."""
    onward = direction @ F
    noise = np.finfo(float).eps * ((direction != 0.0) @ np.abs(F))
    return np.asarray(np.where(np.abs(onward) > noise, onward, 0.0))
