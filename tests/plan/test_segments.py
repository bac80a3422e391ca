"""A time-invariant plan makes its matrices once a segment, and its gains without looking at the data."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import Record
from estimfw.estimators.numpy_scan import NumpyScan
from estimfw.run.from_python import open_filter
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare

EXAMPLES = Path(__file__).parents[2] / "examples"
Opened = Callable[..., Problem]


@pytest.fixture
def opened() -> Opened:
    """``opened("thermal", "a.b=1")``."""

    def make(example: str, *overrides: str) -> Problem:
        return open_filter(EXAMPLES / f"{example}.yaml", overrides)

    return make


def scanned(problem: Problem, record: Record | None = None) -> tuple[NumpyScan, np.ndarray]:
    """The scan after a run, and the covariances along it."""
    prepared = prepare(problem, load_record(problem) if record is None else record)
    assert isinstance(prepared.scan, NumpyScan)
    _, result = prepared.scan.run(prepared.state, make_chunk(prepared, 0, len(prepared.steps)))
    return prepared.scan, result.covariance


def test_one_segment_for_each_value_of_the_heater(opened: Opened) -> None:
    """0 W, 5 W, 2 W at one step length: three sets of matrices for 720 steps."""
    problem = opened("thermal", "estimator.kernel=numpy")
    assert problem.plan.time_invariant
    scan, covariance = scanned(problem)
    assert len(covariance) == 720
    assert len(scan.tables) == 3
    assert {dt for dt, _ in scan.tables} == {5.0}
    F, D, _ = (m[0] for m in zip(*[scan.tables[k] for k in scan.tables], strict=True))
    assert all(np.array_equal(Phi, F) and np.array_equal(Q, D) for Phi, Q, _ in scan.tables.values())


def test_segments_differ_by_the_length_of_a_step(opened: Opened) -> None:
    """Fixes at 2 Hz and speeds at 5 Hz fall 0.1 s or 0.2 s apart: two sets of matrices, each exact for its length."""
    scan, covariance = scanned(opened("tracker", "estimator.kernel=numpy"))
    assert len(covariance) == 720
    for (dt, _), (Phi, _, _) in scan.tables.items():
        assert np.allclose(Phi, np.block([[np.eye(2), dt * np.eye(2)], [np.zeros((2, 2)), np.eye(2)]]), atol=1e-15)
    assert sorted(round(dt, 12) for dt, _ in scan.tables) == [0.1, 0.2]


def test_the_gains_of_an_ungated_plan_do_not_depend_on_the_data(opened: Opened) -> None:
    """So all runs of a Monte Carlo share them."""
    first, second = (
        scanned(opened("tracker", f"source.seed={seed}", "estimator.gate=null", "estimator.kernel=numpy"))[1]
        for seed in (1, 2)
    )
    assert np.array_equal(first, second)


def test_the_hash_of_a_plan_does_not_depend_on_the_data(opened: Opened) -> None:
    hashes = {opened("tracker", f"source.seed={s}", f"source.duration={d} s").plan.hash for s, d in ((1, 60), (2, 120))}
    assert len(hashes) == 1
    assert opened("tracker", "blocks.velocity.noise=0.4 m/s/sqrt(s)").plan.hash not in hashes
