"""No work is hidden around the kernel: a step of a run takes less than twice that of the recursion alone."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from estimfw.config.compose import Problem
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare
from estimfw.run.run import run_problem

Open = Callable[..., Problem]


@pytest.mark.slow
@pytest.mark.parametrize("interval", ["10 s", "1 s"])
def test_four_hours(opened: Open, interval: str) -> None:
    """The whole run from the record on, by turns with the recursion, the median of nine ratios: the machine may be busy."""
    problem = opened("ins_const11", f"source.interval={interval}", "estimator.kernel=numba")
    record = load_record(problem)
    prepared = prepare(problem, record)
    chunks, first = [], 0
    while first < len(prepared.steps):
        chunks.append(make_chunk(prepared, first, min(first + 4096, len(prepared.steps))))
        first += 4096
    ratios = []
    with threadpool_limits(1, user_api="blas"):
        for _ in range(9):
            begin = time.perf_counter()
            state = prepared.state
            for chunk in chunks:
                state, _ = prepared.scan.run(state, chunk)
            middle = time.perf_counter()
            run_problem(problem, record=record)
            ratios.append((time.perf_counter() - middle) / (middle - begin))
    assert np.median(ratios) < 2.0, ratios
