"""The kernel follows from the length of the work, or from the config; the result says which it was."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import FloatArray
from estimfw.errors import ConfigError
from estimfw.model.coefficient import matrix
from estimfw.model.parts import DerivedVariable
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import make_plan
from estimfw.run import kernel_choice
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem

Example = Callable[..., Problem]


def kernel_of(problem: Problem) -> str:
    return str(run_problem(problem).prepared.scan.name)


@pytest.mark.parametrize(("name", "rate"), [("static_12", 1), ("tracker", 6)])
@pytest.mark.parametrize(("steps", "expected"), [(48, "numpy"), (60, "numba")])
def test_long_work_is_compiled(
    example: Example, monkeypatch: pytest.MonkeyPatch, name: str, rate: int, steps: int, expected: str
) -> None:
    """A second of the tracker, with 2 fixes and 5 speeds, has 6 steps."""
    monkeypatch.setattr(kernel_choice, "LONG", 50)
    assert kernel_of(example(name, f"source.duration={steps // rate} s")) == expected


def unturned(C_bn: FloatArray) -> FloatArray:
    """C C', the identity to rounding."""
    return np.asarray(C_bn @ np.swapaxes(C_bn, -1, -2))


def with_plain_python(problem: Problem) -> Problem:
    """The velocity reads a derived variable that comes from a plain Python function."""
    derived = (*problem.model.derived, DerivedVariable("unturned", (3, 3), ("C_bn",), unturned))
    term = replace(problem.model.term("accel_bias_coupling"), coefficient=matrix("unturned"))
    terms = tuple(term if t.label == term.label else t for t in problem.model.terms)
    model = problem.model.with_parts(derived=derived, terms=terms)
    layout = NominalLayout(problem.plan.layout.variables, derived)
    plan = make_plan(model, layout, problem.provider.slots, problem.plan.discretisation, {})
    return replace(problem, model=model, plan=plan)


def test_plain_python_in_the_loop_works_slower_and_says_so(example: Example, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_choice, "LONG", 50)
    plain = run_problem(with_plain_python(example("static_12", "source.duration=60 s")))
    assert plain.prepared.scan.name == "numpy"
    (event,) = [e for e in plain.events if e.source == "kernel"]
    assert event.text == "the derived variable unturned is plain Python; the NumPy kernel runs, which is slower"
    compiled = run_problem(example("static_12", "source.duration=60 s"))
    assert not [e for e in compiled.events if e.source == "kernel"]
    assert np.allclose(plain.estimate, compiled.estimate, rtol=0, atol=1e-9 * compiled.sigma)


def test_plain_python_is_refused_where_the_config_wants_it_compiled(example: Example) -> None:
    problem = with_plain_python(example("static_12", "source.duration=5 s", "estimator.kernel=numba"))
    with pytest.raises(
        ConfigError, match="kernel: numba cannot run this model: the derived variable unturned is plain Python"
    ):
        run_problem(problem)


def test_loading_the_machine_code_is_no_part_of_the_filters_time(example: Example) -> None:
    """In a process of its own, where nothing is loaded yet; loading takes several tenths of a second."""
    code = (
        "from estimfw.run.from_python import open_filter; from estimfw.run.run import run_problem; "
        "t = run_problem(open_filter('examples/tracker.yaml', ['estimator.kernel=numba'])).timing; print(t.filter / t.prepare)"
    )
    example("tracker")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 0.2


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
