"""The filters are as good as they say: NEES of every state over runs drawn from the prior."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.montecarlo.draw import draw_runs
from estimfw.montecarlo.filtering import filter_runs
from estimfw.run.outputs import state_truth, truth_at

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]
LINEAR = ("source.truth=linear", "estimator.loop=open", "estimator.kernel=numba")
EXACT = ("process.local_level.terms=complete", "estimator.kernel=numba")


def normalised(problem: Problem, runs: int) -> tuple[FloatArray, FloatArray]:
    """NEES over its degrees of freedom at six instants, mean over runs; and the mean square of each state over its variance."""
    draws = draw_runs(problem, 2024, range(runs))
    count = draws.time.size - 1
    grid = np.unique(np.linspace(count // 10, count - 1, 6).astype(np.int64))
    found = filter_runs(problem, draws, grid, runs, [f"run {i}" for i in range(runs)])
    whole, each = [], []
    for r in range(runs):
        truth = truth_at(draws.run(r).truth, draws.time[grid + 1])
        assert truth is not None
        sigma = np.sqrt(np.einsum("gii->gi", found.covariance[r]))
        error = (state_truth(problem, found.rows[r], truth) - found.estimate[r]) / sigma
        correlation = found.covariance[r] / (sigma[:, :, None] * sigma[:, None, :])
        whole.append(np.einsum("gi,gi->g", error, np.linalg.solve(correlation, error[..., None])[..., 0]))
        each.append(error**2)
    return np.mean(whole, axis=0) / error.shape[1], np.mean(each, axis=(0, 1))


@pytest.mark.parametrize("example", ["ins_const11", "ins_gm9_heading"])
def test_a_few_runs(opened: Open, example: str) -> None:
    """40 runs of an hour: NEES scatters by sqrt(2 / 40 n), the square of a constant by sqrt(2 / 40) = 0.22."""
    nees, each = normalised(opened(example, *LINEAR, "source.duration=1 h"), 40)
    assert np.all(np.abs(nees - 1.0) < 3.5 * np.sqrt(2.0 / 40.0 / each.size)), nees
    assert np.all(np.abs(each - 1.0) < 3.5 * 0.22), each


@pytest.mark.slow
@pytest.mark.parametrize("example", ["ins_const11", "ins_const11_heading", "ins_gm9", "ins_gm9_heading", "ins_full14"])
def test_two_hundred_runs_on_the_model_itself(opened: Open, example: str) -> None:
    """NEES within 1 +- 0.14 at every instant; the square of a single constant scatters by 0.1."""
    nees, each = normalised(opened(example, *LINEAR), 200)
    assert np.all(np.abs(nees - 1.0) < 0.14), nees
    assert np.all(np.abs(each - 1.0) < 0.35), each


@pytest.mark.slow
def test_two_hundred_runs_of_an_exact_ins(opened: Open) -> None:
    """A closed loop with all terms, against an INS by its exact equations."""
    nees, each = normalised(opened("ins_const11_heading", *EXACT), 200)
    assert np.all(np.abs(nees - 1.0) < 0.14), nees
    assert np.all(np.abs(each - 1.0) < 0.35), each
