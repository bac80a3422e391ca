"""The kernel follows from the length of the work, or from the config; the result says which it was."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import pytest

from estimfw.config.compose import Problem
from estimfw.run import prepare as preparation
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem

Example = Callable[..., Problem]


def kernel_of(problem: Problem) -> str:
    return str(run_problem(problem).prepared.scan.name)


@pytest.mark.parametrize(("seconds", "expected"), [(49, "numpy"), (50, "numba")])
def test_long_work_with_a_moving_nominal_is_compiled(
    example: Example, monkeypatch: pytest.MonkeyPatch, seconds: int, expected: str
) -> None:
    monkeypatch.setattr(preparation, "LONG_MOVING", 50)
    assert kernel_of(example("static_12", f"source.duration={seconds} s")) == expected


@pytest.mark.parametrize(("seconds", "expected"), [(99, "numpy"), (100, "numba")])
def test_long_work_with_steady_matrices_is_compiled_later(
    example: Example, monkeypatch: pytest.MonkeyPatch, seconds: int, expected: str
) -> None:
    monkeypatch.setattr(preparation, "LONG_MOVING", 1)
    monkeypatch.setattr(preparation, "LONG_STEADY", 600)
    assert kernel_of(example("tracker", f"source.duration={seconds} s")) == expected


def test_the_limits_are_where_the_start_of_compiled_code_pays() -> None:
    assert preparation.LONG_STEADY == 50_000
    assert preparation.LONG_MOVING < preparation.LONG_STEADY


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_the_config_has_the_last_word_and_the_result_says_it(example: Example, kernel: str) -> None:
    run = run_problem(example("tracker", "source.duration=5 s", f"estimator.kernel={kernel}"))
    assert run.prepared.scan.name == kernel
    assert f'"kernel": "{kernel}"' in result_dataset(run).attrs["provenance"]


def test_short_work_does_not_import_numba() -> None:
    code = (
        "import sys; from estimfw.run.from_python import open_filter; from estimfw.run.run import run_problem; "
        "run_problem(open_filter('examples/tracker.yaml')); assert 'numba' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
