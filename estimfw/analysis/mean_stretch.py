"""A part of a record as one frozen system."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.observability import LinearStretch

__all__ = ["MeanStretch"]

FloatArray = NDArray[np.float64]


class MeanStretch:
    """Means of F, and of those rows of H that are fused; F is itself, without rounding, where it is the same at every step."""

    def __init__(self) -> None:
        self._F: FloatArray | None = None
        self._first: FloatArray | None = None
        self._same = True
        self._steps = 0
        self._rows: FloatArray | None = None
        self._used: FloatArray | None = None

    def add(self, F: FloatArray, H: FloatArray, usable: NDArray[np.bool_]) -> None:
        """K more steps: F (K, n, n), H (K, m, n), and which rows were fused (K, m)."""
        if self._first is None or self._F is None or self._rows is None or self._used is None:
            self._first, self._F, self._rows = F[0], np.zeros_like(F[0]), np.zeros_like(H[0])
            self._used = np.zeros(H.shape[1])
        self._same = self._same and bool(np.all(self._first == F))
        self._F = self._F + F.sum(axis=0)
        self._rows = self._rows + np.einsum("km,kmn->mn", usable.astype(float), H)
        self._used = self._used + usable.sum(axis=0)
        self._steps += len(F)

    def mean(self, duration: float) -> LinearStretch:
        """The frozen stretch of what was added, ``duration`` s long; rows that were never fused are left out."""
        assert self._F is not None and self._rows is not None and self._used is not None and self._first is not None
        F = self._first if self._same else self._F / self._steps
        used = self._used > 0.0
        return LinearStretch(F, self._rows[used] / self._used[used, None], duration)
