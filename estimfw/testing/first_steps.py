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
    """The provider, its state (n_state,) and row (provided,) at the start, samples (K, n_sample), dt (K,) in s, inputs (K, m)."""

    provider: BoundProvider
    state: FloatArray
    row: FloatArray
    samples: FloatArray
    dt: FloatArray
    inputs: FloatArray


def first_steps(problem: Problem, count: int) -> FirstSteps | None:
    """The first ``count`` steps of the filter's record; None where no provider moves the nominal."""
    prepared = prepare(problem, load_record(problem))
    if prepared.bound is None:
        return None
    chunk = make_chunk(prepared, 0, min(count, len(prepared.steps)))
    start = prepared.state
    return FirstSteps(prepared.bound, start.provider, start.row, chunk.samples, chunk.dt, chunk.inputs)
