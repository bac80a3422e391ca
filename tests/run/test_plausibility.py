"""Data that contradict what was believed before are told; what the model may do by itself is no contradiction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from scipy.linalg import expm

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.model.build import build_model
from estimfw.model.coefficient import constant
from estimfw.model.parts import BlockParts, NoiseInput, ProcessParts, ProcessTerm, StateBlock
from estimfw.run.answer import answer
from estimfw.run.dataset import result_dataset
from estimfw.run.plausibility import cautions, unmeasured
from estimfw.run.run import run_problem
from estimfw.run.summary import events_of
from estimfw.run.until import until

Composed = Callable[[str], Problem]

BIASES = """estimfw: 1
blocks:
  bias: {kind: random_constant, unit: m, axes: [x, y, z], sigma: 1 m}
measurements: {fix: {kind: direct, of: [{block: bias}], noise: 0.1 m}}
"""
WALK = """estimfw: 1
blocks:
  position: {kind: random_constant, unit: m, sigma: 1 m}
  velocity: {kind: random_walk, unit: m/s, sigma: 0.1 m/s, noise: 2 m/s/sqrt(s)}
process: {kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}}
measurements: {fix: {kind: direct, of: [{block: position}], noise: 0.1 m}}
"""

HELD = """estimfw: 1
blocks:
  a: {kind: random_constant, unit: m, sigma: 1 m}
  b: {kind: random_constant, unit: m, sigma: 10 m}
measurements: {fix: {kind: direct, of: [{block: a}, {block: b}], noise: 0.1 m}}
estimator: {kind: kalman, stages: [{name: first, estimate: [a]}]}
"""


def run(problem: Problem, rows: np.ndarray, columns: tuple[str, ...]) -> xr.Dataset:
    time = np.arange(1.0, len(rows) + 1)
    record = Record({"fix": Stream("fix", time, rows, columns, "sample", 1.0)}, initial={"time": np.array(0.0)})
    return result_dataset(run_problem(problem, record=record))


def test_a_bias_far_outside_its_prior_is_told_the_worst_first(composed: Composed) -> None:
    result = run(composed(BIASES), np.tile([4.0, 20.0, -9.0], (400, 1)), ("x", "y", "z"))
    told = cautions(result)
    assert [one.split(" from")[0] for one in told[:2]] == ["bias[y] is 20 prior sigmas", "bias[z] is 9 prior sigmas"]
    assert not any("bias[x]" in one for one in told), "4 sigmas are not 5"
    assert answer(result)["cautions"] == told
    events = [e for e in events_of(result) if e.kind == "implausible"]
    assert [(e.source, e.time) for e in events] == [("bias[y]", 400.0), ("bias[z]", 400.0)]


def test_cut_before_the_bias_was_learnt_nothing_is_told_of_it(composed: Composed) -> None:
    rows = np.concatenate([np.zeros((100, 3)), np.tile([0.0, 40.0, 0.0], (300, 1))])
    result = run(composed(BIASES), rows, ("x", "y", "z"))
    assert [e.source for e in events_of(result) if e.kind == "implausible"] == ["bias[y]"]
    assert cautions(until(result, 100.0)) == []


def test_states_that_others_drive_or_that_walk_are_held_against_what_they_may_do(composed: Composed) -> None:
    """A tracker that leaves: its position is 10 000 prior sigmas away, its velocity 300, and both may be so."""
    time = np.arange(1.0, 401)
    result = run(composed(WALK), 0.075 * time[:, None] ** 2, ("fix",))
    assert result["estimate"][-1, 1] > 300 * 0.1
    assert cautions(result) == []


def test_what_a_held_state_does_to_an_estimate_is_no_contradiction_unless_it_is_more_than_it_may_do(
    composed: Composed,
) -> None:
    """The fix reads a + b, and b, 10 m by its prior, is believed to be zero: a takes all of it."""
    result = run(composed(HELD), np.full((400, 1), 15.0), ("fix",))
    assert result["estimate"][-1, 0] > 14.9, "15 prior sigmas"
    assert result["honest_sigma"][-1, 0] == pytest.approx(10.0, rel=1e-3)
    assert [e for e in events_of(result) if e.kind == "implausible"] == []
    result = run(composed(HELD), np.full((400, 1), 80.0), ("fix",))
    (told,) = [e.text for e in events_of(result) if e.kind == "implausible"]
    assert told.startswith("a is 80 prior sigmas from its prior (honest: 7.96): ")
    assert told in cautions(result)


def test_honest_sigmas_that_are_the_own_ones_excuse_nothing(composed: Composed) -> None:
    text = HELD.replace("estimate: [a]", "consider: [b]").replace("10 m", "0.001 m")
    result = run(composed(text), np.full((400, 1), 5.1), ("fix",))
    assert "honest_sigma" in result
    (told,) = [e.text for e in events_of(result) if e.source == "a" and e.kind == "implausible"]
    assert told.startswith("a is 5.1 prior sigmas from its prior: ")


def test_innovations_far_above_what_is_expected_are_told(composed: Composed) -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.1, (400, 3))
    columns = ("x", "y", "z")
    assert cautions(run(composed(BIASES), 1.5 * noise, columns)) == [], "a factor of 2.25 in NIS is not 3"
    (told,) = cautions(run(composed(BIASES), 4.0 * noise, columns))
    assert told.startswith("the mean NIS of fix is ")
    assert "about 4 times" in told or "about 3.9 times" in told or "about 4.1 times" in told


@pytest.mark.parametrize("rate", [0.0, -0.05, 0.02])
def test_mean_and_sigma_without_measurements_follow_the_lyapunov_equation(rate: float) -> None:
    """P' = 2 f P + q, by the matrix exponential of the pair (P, 1)."""
    block = StateBlock("x", ("",), ("",), "m", quantity="x")
    noise = NoiseInput("w", ("",), ("",), (0.3,), "m/s")
    terms = (ProcessTerm("own", "x", "x", constant([[rate]])), ProcessTerm("drive", "x", "w", constant([[2.0]])))
    model = build_model([BlockParts(block, ((4.0,),), (5.0,))], [ProcessParts(terms, (noise,))])
    t = np.array([0.0, 1.0, 30.0])
    mean, sigma = unmeasured(model, {}, model.prior.evaluate({}), t, frozenset())
    lyapunov = np.array([[2 * rate, 0.3 * 4.0], [0.0, 0.0]])
    np.testing.assert_allclose(sigma[:, 0] ** 2, [(expm(lyapunov * one) @ [4.0, 1.0])[0] for one in t], rtol=1e-12)
    np.testing.assert_allclose(mean[:, 0], 5.0 * np.exp(rate * t), rtol=1e-12)
    assert np.isnan(unmeasured(model, {}, model.prior.evaluate({}), t, frozenset({"x"}))[1]).all()


def test_gates_that_refuse_much_are_told_where_sigmas_are_honest(composed: Composed) -> None:
    held = (
        BIASES
        + "estimator: {kind: kalman, gate: 0.99, stages: [{name: one, until: 200 s, estimate: [bias]}, {name: all}]}\n"
    )
    part = held.replace("estimate: [bias]", "estimate: ['bias[x]', 'bias[y]']")
    rows = np.tile([0.5, -0.5, 9.0], (400, 1))
    told = cautions(run(composed(part), rows, ("x", "y", "z")))
    assert any(one.startswith("fix was gated in ") and "honest sigmas take as given" in one for one in told)
    right = cautions(run(composed(part), np.tile([0.5, -0.5, 0.0], (400, 1)), ("x", "y", "z")))
    assert not any("gated" in one for one in right)
