"""The nominal of a schedule over time, for a source that simulates the model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.model.nominal import ScheduledProvider
from estimfw.plan.layout import NominalLayout

__all__ = ["RowsOverTime"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RowsOverTime:
    """Complete nominal rows at any time; ``instants`` (s) are those at which they change.

    ``provider`` is driven by time alone, and has no state.
    """

    instants: tuple[float, ...]
    provider: ScheduledProvider
    layout: NominalLayout

    def between(self, begin: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Process rows and end rows (K, size) of intervals from begin (K,) to end (K,), s."""
        samples = self.provider.samples_between(begin, end)
        _, process, last = self.provider.step(np.zeros((len(end), 0)), samples)
        return self.layout.complete(process), self.layout.complete(last)
