"""Many runs of one recursion over one timeline: arrays with a leading axis over the runs, the same scan for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, Protocol

import numpy as np

from estimfw.estimators.scan import Chunk, ChunkResult, FilterState

__all__ = ["OneScan", "scan_runs"]


class OneScan(Protocol):
    """A recursion bound to the start of one run."""

    def run(self, state: FilterState, chunk: Chunk) -> tuple[FilterState, ChunkResult]: ...


def scan_runs(
    scans: Sequence[OneScan], states: Sequence[FilterState], chunk: Chunk
) -> tuple[list[FilterState], ChunkResult]:
    """K steps of R runs.

    Parameters
    ----------
    scans : sequence of R recursions
        Each bound to the start of its run.
    states : sequence of R FilterState
    chunk : Chunk
        ``samples`` (R, K, n_sample) or (K, n_sample), ``readings`` (R, K, rows); the rest is common to all runs.

    Returns
    -------
    list of R FilterState
    ChunkResult
        All its arrays with a leading axis over the runs; without moves.
    """
    after, results = [], []
    for r, (scan, state) in enumerate(zip(scans, states, strict=True)):
        samples = chunk.samples[r] if chunk.samples.ndim == 3 else chunk.samples
        state, result = scan.run(state, replace(chunk, samples=samples, readings=chunk.readings[r]))
        after.append(state)
        results.append(result)
    names = [f.name for f in fields(ChunkResult) if f.name != "moves"]
    joined: dict[str, Any] = {name: np.stack([getattr(one, name) for one in results]) for name in names}
    return after, ChunkResult(**joined)
