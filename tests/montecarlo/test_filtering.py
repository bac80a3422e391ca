"""Runs in a batch are the runs one by one, to the last bit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.montecarlo import filtering
from estimfw.montecarlo.draw import draw_runs, drawn_record
from estimfw.montecarlo.filtering import filter_runs
from estimfw.montecarlo.part import errors_at
from estimfw.run.run import run_problem

Example = Callable[..., Problem]
CASES = {
    "tracker": ("tracker", ("source.duration=20 s", "estimator.gate=0.9")),
    "thermal": ("thermal", ("source.duration=400 s",)),
    "12 states": ("static_12", ("source.duration=30 s", "estimator.restarts=[10 s]")),
    "7 states": ("static_7", ("source.duration=30 s",)),
    "closed loop": ("static_12", ("source.duration=30 s", "policies=[]", "estimator={kind: kalman, loop: closed}")),
}


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("case", CASES)
def test_a_run_of_a_batch_is_that_run_alone(
    example: Example, monkeypatch: pytest.MonkeyPatch, case: str, kernel: str
) -> None:
    name, overrides = CASES[case]
    problem = example(name, *overrides, f"estimator.kernel={kernel}")
    monkeypatch.setattr(filtering, "LONGEST_STRETCH", 13)
    draws = draw_runs(problem, 5, range(4))
    one = run_problem(problem, record=drawn_record(problem, 5, 2))
    steps = np.arange(len(one.prepared.steps))
    done = filter_runs(problem, draws, steps, 4, ["a", "b", "c", "d"])
    np.testing.assert_array_equal(done.estimate[2], one.estimate)
    np.testing.assert_array_equal(done.covariance[2], one.covariance)
    np.testing.assert_array_equal(done.nis[2], one.nis)
    error, variance = errors_at(problem, draws, done, one.prepared.steps.time)
    assert one.truth is not None and one.output_error is not None
    np.testing.assert_array_equal(error[2], np.hstack([one.estimate - one.truth, one.output_error]))
    np.testing.assert_allclose(np.sqrt(variance[2]), np.hstack([one.sigma, one.output_sigma]), rtol=1e-12)
    assert not np.array_equal(done.estimate[1], done.estimate[2])


def test_a_run_is_the_same_whatever_runs_beside_it(example: Example) -> None:
    problem = example("static_12", "source.duration=5 s")
    several, alone = draw_runs(problem, 9, [3, 7]), draw_runs(problem, 9, [7])
    for name, stream in alone.record.streams.items():
        np.testing.assert_array_equal(several.record.streams[name].values[1], stream.values[0])
    np.testing.assert_array_equal(several.record.initial["C_bn"][1], alone.record.initial["C_bn"][0])
