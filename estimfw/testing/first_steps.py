"""A filter at its start with a few samples of its own record: what the checks work on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.model.nominal import BoundProvider
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare

__all__ = ["FirstSteps", "first_steps"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FirstSteps:
    """The provider, its state at the start (n_state,), samples (K, n_sample), dt (K,) in s and inputs (K, known inputs)."""

    provider: BoundProvider
    state: FloatArray
    samples: FloatArray
    dt: FloatArray
    inputs: FloatArray


def first_steps(problem: Problem, count: int) -> FirstSteps | None:
    """The first ``count`` steps of the filter's record; None where no provider moves the nominal."""
    prepared = prepare(problem, load_record(problem))
    if prepared.bound is None:
        return None
    chunk = make_chunk(prepared, 0, min(count, len(prepared.steps)))
    return FirstSteps(prepared.bound, prepared.state.provider, chunk.samples, chunk.dt, chunk.inputs)
