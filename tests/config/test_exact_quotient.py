"""A quotient that would not be exact for what runs is refused."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from estimfw.config.compose import Problem
from estimfw.config.exact_quotient import refuse_inexact_quotient
from estimfw.config.generic.nominal import ConstantNominal
from estimfw.errors import ConfigError
from estimfw.model.nominal import AxisMirror, Operation

TEXT = """
estimfw: 1
blocks:
  level: {kind: random_walk, unit: m, sigma: 10 m, noise: 0.1 m/sqrt(s)}
  rate: {kind: random_constant, unit: m/s, sigma: 1 m/s}
  drift: {kind: random_constant, unit: m/s, sigma: 0.1 m/s, quantity: clock}
process:
  climb: {kind: couple, target: level, source: rate, coefficient: 2}
  creep: {kind: couple, target: level, source: drift, coefficient: 1}
measurements:
  gauge: {kind: direct, of: [{block: level}], noise: 1 m}
policies:
  - {kind: prune_unobservable, mode: quotient, protect: [rate]}
source: {kind: simulate_model, duration: 10 s, rate: 1 Hz}
"""


@pytest.fixture(scope="module")
def problem(composed: Callable[[str], Problem]) -> Problem:
    return composed(TEXT)


def test_a_rate_stands_for_what_it_cannot_be_told_from(problem: Problem) -> None:
    assert problem.model.state_meanings == ("level", "rate + 0.5 * drift")


def test_where_the_nominal_would_leave_out_an_operation_with_the_state_it_is_refused(problem: Problem) -> None:
    computes = ConstantNominal(operations=(Operation("tick", AxisMirror("clock")),))
    with pytest.raises(ConfigError, match="would leave out tick"):
        refuse_inexact_quotient(problem.model, problem.plan, computes, frozenset({"tick"}))


def test_a_policy_after_it_is_refused_with_its_place(composed: Callable[[str], Problem]) -> None:
    later = TEXT.replace("protect: [rate]}", "protect: [rate]}\n  - {kind: drop_states, states: [rate]}")
    with pytest.raises(ConfigError, match="exact quotient, which a further change would spoil") as caught:
        composed(later)
    assert caught.value.location is not None
