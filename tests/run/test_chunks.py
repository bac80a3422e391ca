"""A run in pieces is the run: any chunk size, any time, the same bits; and memory does not grow with the covariances."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.run import run as runner
from estimfw.run.run import Collected, run_problem

Example = Callable[..., Problem]
RUNS = {
    "tracker": ("tracker", ("source.duration=30 s",)),
    "alignment": ("static_12", ("source.duration=60 s", "estimator.restarts=[20 s]")),
    "closed loop": ("static_12", ("source.duration=60 s", "policies=[]", "estimator={kind: kalman, loop: closed}")),
}


def assert_identical(one: Collected, other: Collected) -> None:
    for name in (
        "estimate",
        "sigma",
        "covariance",
        "innovation",
        "innovation_sigma",
        "nis",
        "disposition",
        "used",
        "output",
    ):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("case", RUNS)
@pytest.mark.parametrize("size", [1, 7])
def test_results_do_not_depend_on_the_chunk_size(
    example: Example, monkeypatch: pytest.MonkeyPatch, case: str, size: int, kernel: str
) -> None:
    name, overrides = RUNS[case]
    problem = example(name, *overrides, f"estimator.kernel={kernel}")
    whole = run_problem(problem)
    monkeypatch.setattr(runner, "LONGEST_CHUNK", size)
    progress: list[tuple[int, int]] = []
    pieces = run_problem(problem, lambda done, total: progress.append((done, total)))
    assert_identical(whole, pieces)
    count = len(whole.prepared.steps)
    assert progress == [(min(first + size, count), count) for first in range(0, count, size)]


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_the_same_seed_gives_the_same_bits(example: Example, kernel: str) -> None:
    overrides = ("source.duration=30 s", f"estimator.kernel={kernel}")
    one, again = (run_problem(example("static_12", *overrides)) for _ in range(2))
    assert_identical(one, again)
    other = run_problem(example("static_12", *overrides, "source.seed=2"))
    assert not np.array_equal(one.estimate, other.estimate)


def test_memory_is_bounded_by_the_chunk(example: Example) -> None:
    # 12 x 12 covariances of all steps would be 1152 bytes a step, the nominal another 200.
    def peak(steps: int) -> int:
        problem = example(
            "static_12", f"source.duration={steps} s", "source.rate=1 Hz", "estimator.kernel=numba",
            "estimator.covariance_samples=10",
        )  # fmt: skip
        run_problem(problem)
        tracemalloc.start()
        run_problem(problem)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    a_step = (peak(40_000) - peak(10_000)) / 30_000
    assert a_step < 1152
