"""How long a step takes: several filters by turns, so that a busy machine slows all of them alike."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimfw.estimators.scan import Chunk
from estimfw.run.prepare import Prepared, make_chunk

__all__ = ["StepTime", "step_times"]

#: Steps that are timed at most, and what one measurement lasts at least (s): the same steps are run again until then.
MOST_STEPS = 200
SHORTEST = 0.02


@dataclass(frozen=True, slots=True)
class StepTime:
    """``seconds`` a step, provider and filter together, of a bank all members: the median over the repeats; ``ratio`` the median
    of the ratios to the first filter within a repeat; ``kernel`` is what ran."""

    seconds: float
    ratio: float
    kernel: str


def step_times(filters: Sequence[Prepared], repeats: int, most: int = MOST_STEPS) -> tuple[StepTime, ...]:
    """Time prepared filters over the first steps of their records, by turns.

    Parameters
    ----------
    filters : sequence of Prepared
        They should have run before, so that nothing is compiled or loaded any more.
    repeats : int
    most : int
        Steps, at most.
    """
    chunks = [make_chunk(p, 0, min(len(p.steps), most)) for p in filters]
    spent = np.empty((repeats, len(filters)))
    for turn in range(repeats):
        for i, (prepared, chunk) in enumerate(zip(filters, chunks, strict=True)):
            spent[turn, i] = _seconds_a_step(prepared, chunk)
    seconds, ratio = np.median(spent, axis=0), np.median(spent / spent[:, :1], axis=0)
    return tuple(StepTime(float(s), float(r), p.scan.name) for s, r, p in zip(seconds, ratio, filters, strict=True))


def _seconds_a_step(prepared: Prepared, chunk: Chunk) -> float:
    begin, steps = time.perf_counter(), 0
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        while (spent := time.perf_counter() - begin) < SHORTEST or not steps:
            for member in prepared.members:
                member.scan.run(member.state, chunk)
            steps += len(chunk)
    return spent / steps
