"""A stretch of a run after the filter: what an analysis along the record actually run needs to know of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.scan import Chunk, ChunkResult, FilterState
from estimfw.kernels.fuse import FUSED
from estimfw.model.nominal import BoundProvider
from estimfw.plan.plan import Plan

__all__ = ["Stretch", "Watcher"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Stretch:
    """K steps of one run.

    Attributes
    ----------
    plan : Plan
    provider : BoundProvider or None
    chunk : Chunk
        What went in.
    result : ChunkResult
        What came out.
    before : FilterState
        Where it began.
    covariance_before : (n, n) array
        Of the estimate there.
    prior_mean, prior : (n,) and (n, n) array
        What a restart begins with: mean and covariance.
    time : (K,) array, s
        Ends of the steps.
    doublings : callable
        Sub-steps of a step of a given length.
    closed_loop : bool
    """

    plan: Plan
    provider: BoundProvider | None
    chunk: Chunk
    result: ChunkResult
    before: FilterState
    covariance_before: FloatArray
    prior_mean: FloatArray
    prior: FloatArray
    time: FloatArray
    doublings: Callable[[float], int]
    closed_loop: bool

    def __len__(self) -> int:
        return len(self.chunk)

    @cached_property
    def usable(self) -> NDArray[np.bool_]:
        """Which rows of the measurements were fused, (K, all rows)."""
        fused = np.repeat(self.result.disposition == FUSED, [m.rows for m in self.plan.measurements], axis=1)
        return np.asarray(fused & np.isfinite(self.result.innovation))

    @cached_property
    def corrected(self) -> NDArray[np.bool_]:
        """At the end of which steps the provider was corrected by the estimate, (K,)."""
        any_fused = np.any(self.result.disposition == FUSED, axis=1)
        return np.asarray(any_fused & bool(self.closed_loop and self.provider is not None and any(self.plan.corrected)))

    @cached_property
    def end_rows(self) -> FloatArray:
        """The nominal at the end of each step, (K, size), complete, before a correction."""
        return self.plan.layout.complete(self.result.rows)

    @cached_property
    def rows(self) -> tuple[FloatArray, FloatArray]:
        """Process rows and end rows (K, size), complete, as the filter met them."""
        if self.provider is None:
            row = self.plan.layout.complete(self.before.row)
            return np.broadcast_to(row, (len(self), *row.shape)), self.end_rows
        _, process, _ = self.provider.step(self._begun, self.chunk.samples)
        return self.plan.layout.complete(process), self.end_rows

    @cached_property
    def best_rows(self) -> tuple[FloatArray, FloatArray]:
        """Process and end rows (K, provided) of a provider that begins each step as the estimate after it says it should have.

        The operating point as it is believed to be at that time, also in open loop.
        """
        if self.provider is None:
            return np.broadcast_to(self.before.row, self.result.rows.shape), self.result.rows
        state = self._begun
        if any(self.plan.corrected):
            state = self.provider.correct(state, self._taken_off(self.result.estimate, self.result.rows))
        _, process, end = self.provider.step(state, self.chunk.samples)
        return process, end

    @cached_property
    def _begun(self) -> FloatArray:
        """The provider's state at the begin of each step (K, n_state), corrected where the filter did."""
        assert self.provider is not None
        state = np.vstack([self.before.provider, self.result.provider[:-1]])
        if not any(self.plan.corrected):
            return state
        x = np.vstack([self.before.x, self.result.estimate[:-1]])
        row = np.vstack([self.before.row, self.result.rows[:-1]])
        correcting = np.append(False, self.corrected[:-1]) | self.chunk.restart
        return self.provider.correct(state, np.where(correcting[:, None], self._taken_off(x, row), 0.0))

    def _taken_off(self, x: FloatArray, row: FloatArray) -> FloatArray:
        """What estimates x (K, n) at nominal rows (K, provided) take off the nominal, (K, 3 * slots)."""
        C = self.plan.correction.evaluate(self.plan.layout.complete(row))
        return np.asarray(np.einsum("kij,kj->ki", C, x))


Watcher = Callable[[Stretch], None]
"""Gets to see each stretch of a run, in order."""
