"""The conformance kit passes what is right and names what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw import open_filter
from estimfw.config.compose import Problem
from estimfw.model.coefficient import constant
from estimfw.plan.plan import make_plan
from estimfw.testing import check_measurements, check_outputs, check_provider

EXAMPLES = Path(__file__).parents[2] / "examples"
TILTED = ["source.misalignment=[0 deg, 0 deg, 0 deg]", "source.noise=false"]
TILTED += [f"initial_attitude.{name}={angle} deg" for name, angle in (("yaw", 40), ("pitch", 5), ("roll", -7))]


@pytest.fixture(params=["static_12", "static_10", "static_7"])
def problem(request: pytest.FixtureRequest) -> Problem:
    return open_filter(EXAMPLES / f"{request.param}.yaml", TILTED)


@pytest.mark.parametrize("check", [check_provider, check_outputs, check_measurements])
def test_alignment_filters_conform(problem: Problem, check: Callable[[Problem], None]) -> None:
    check(problem)


@pytest.mark.parametrize("check", [check_provider, check_outputs, check_measurements])
def test_filter_without_provider_has_nothing_to_conform_to(check: Callable[[Problem], None]) -> None:
    check(open_filter(EXAMPLES / "tracker.yaml"))


def with_model(problem: Problem, **parts: Any) -> Problem:
    model = problem.model.with_parts(**parts)
    old = problem.plan
    plan = make_plan(model, old.layout, problem.provider.slots, old.discretisation, {})
    return replace(problem, model=model, plan=plan)


def test_wrong_sign_of_a_measurement_is_named(problem: Problem) -> None:
    (m,) = problem.model.measurements
    flipped = replace(m, terms=tuple(replace(t, coefficient=-t.coefficient) for t in m.terms))
    with pytest.raises(AssertionError, match=r"measurement zero_velocity: correcting velocity_error\[E\]"):
        check_measurements(with_model(problem, measurements=(flipped,)))


def test_wrong_dynamics_are_named(problem: Problem) -> None:
    terms = tuple(
        replace(t, coefficient=-t.coefficient) if t.label == "gravity_tilt" else t for t in problem.model.terms
    )
    with pytest.raises(AssertionError, match=r"measurement zero_velocity: correcting attitude_error"):
        check_measurements(with_model(problem, terms=terms))


def test_wrong_jacobian_of_an_output_is_named(problem: Problem) -> None:
    (output,) = problem.model.outputs
    (name, _, frame) = output.jacobian[0]
    wrong = replace(output, jacobian=((name, constant(np.ones((4, 3))), frame),))
    with pytest.raises(AssertionError, match=r"output attitude: its Jacobian over attitude_error\[E\]"):
        check_outputs(with_model(problem, outputs=(wrong,)))


class Impure:
    """A provider whose step writes into the state that it was given."""

    def __init__(self, inner: Any) -> None:
        self.inner = inner

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def step(self, state: np.ndarray, sample: np.ndarray) -> Any:
        made = self.inner.step(state, sample)
        state += 1.0
        return made


def test_step_that_writes_into_its_state_is_named(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    bind = type(problem.provider).bind
    monkeypatch.setattr(type(problem.provider), "bind", lambda self, settings: Impure(bind(self, settings)))
    with pytest.raises(AssertionError, match="writes into its state"):
        check_provider(problem)
