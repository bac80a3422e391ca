"""What a section of nodes refuses, and where; and that a cut plan stands for the filter it was cut from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError

Composed = Callable[[str], Problem]

MODEL = """\
estimfw: 1
blocks:
  position: {kind: random_constant, unit: m, axes: [x, y], sigma: 50 m}
  velocity: {kind: random_walk, unit: m/s, axes: [x, y], sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}, {block: velocity, coefficient: 0.1}], noise: 3 m, correlation: [[1, 0.5], [0.5, 1]]}
  speed: {kind: direct, of: [{block: velocity, axes: [x]}], rows: [x], noise: 0.2 m/s}
estimator:
  kind: decentralised
"""
EAST = '    - {name: east, blocks: ["position[x]", "velocity[x]"], measurements: ["fix[x]", speed]}\n'
NORTH = '    - {name: north, blocks: ["position[y]", "velocity[y]"], measurements: ["fix[y]"]}\n'


def nodes(*lines: str, more: str = "") -> str:
    return MODEL + "  nodes:\n" + "".join(lines) + more


@pytest.mark.parametrize(
    ("text", "message", "hint", "line"),
    [
        (nodes(EAST, NORTH.replace("velocity[y]", "velocty[y]")), "no block or state 'velocty[y]'", "'velocity[y]'", 14),
        (nodes(EAST, NORTH.replace("fix[y]", "fx[y]")), "no measurement or row 'fx[y]'", "'fix[y]'", 14),
        (nodes(EAST), "no node owns the states position[y], velocity[y]", "add position[y]", 13),
        (nodes(EAST, NORTH.replace('["fix[y]"]', "[]")), "no node owns the row fix[y]", "add fix[y]", 13),
        (nodes(EAST, NORTH.replace("position[y]", "position")), "state position[x] belongs to two nodes, east and north",
         "exactly one", 14),
        (nodes(EAST, NORTH.replace("fix[y]", "fix")), "row fix[x] belongs to two nodes, east and north", "exactly one", 14),
        (nodes(EAST, NORTH.replace("north", "east")), "two nodes are called 'east'", None, 14),
        (nodes(EAST, NORTH.replace('"velocity[y]"]', '"velocity[y]", "velocity[y]"]')), "belongs to the node north twice",
         "exactly one", 14),
        (nodes(EAST, NORTH, more="  exchange: {silent: [{node: nort, from: 1 s, until: 2 s}]}\n"), "no node 'nort'",
         "'north'", 15),
        (nodes(EAST, NORTH, more="  exchange: {silent: [{node: north, from: 2 s, until: 1 s}]}\n"), "is not after", None, 15),
        (nodes(EAST, NORTH, more="  gates: {fix@nort: 0.9}\n"), "gates names no measurement: 'fix@nort'", "'fix@north'", 15),
        (nodes(EAST, NORTH, more="  cross_covariance: decoupled\n  exchange: {silent: [{node: north, from: 1 s, until: 2 s}]}\n"),
         "nobody hears of a decoupled node", "exact or drop", 15),
        (nodes(EAST.replace(', "velocity[x]"', ""), NORTH.replace('"velocity[y]"', "velocity"),
               more="  cross_covariance: drop\n"),
         "of node east reads velocity[x], which another node owns", "cross_covariance: exact", 15),
        (nodes(EAST.replace("blocks:", "block:"), NORTH), "block", "blocks", 13),
        (MODEL + "  nodes: []\n", "nodes", None, 12),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_where_it_stands(
    composed: Composed, text: str, message: str, hint: str | None, line: int
) -> None:
    with pytest.raises(ConfigError) as caught:
        composed(text)
    error = caught.value
    assert message in error.message
    assert hint is None or hint in (error.hint or "")
    assert error.location is not None and error.location.line == line


def test_gates_name_a_measurement_or_the_part_of_one_node(composed: Composed) -> None:
    problem = composed(nodes(EAST, NORTH, more="  gate: 0.9\n  gates: {fix: 0.99, fix@north: null}\n"))
    assert {m.name: m.gate for m in problem.plan.measurements} == {"fix@east": 0.99, "speed": 0.9, "fix@north": None}


def test_a_cut_plan_has_the_design_and_the_noise_of_the_whole(composed: Composed) -> None:
    """Rows in another order: fix[x], speed, fix[y], with the noise that fix[x] and fix[y] share."""
    plan = composed(nodes(EAST, NORTH)).plan
    labels = [label for m in plan.measurements for label in m.labels]
    order = [[x for m in plan.whole.measurements for x in m.labels].index(label) for label in labels]
    assert labels == ["fix[x]", "speed[x]", "fix[y]"]
    row, interval = plan.layout.complete(np.zeros(plan.layout.provided)), np.full((1, 3), 0.5)
    np.testing.assert_array_equal(plan.design(row), plan.whole.design(row)[order])
    R = plan.whole.noise(interval[:, :2])[0]
    np.testing.assert_array_equal(plan.noise(interval)[0], R[np.ix_(order, order)])
    assert plan.noise(interval)[0][0, 2] == pytest.approx(4.5)
    assert plan.hash != plan.whole.hash


def test_decoupled_filters_have_what_they_own_of_phi_q_and_h(composed: Composed) -> None:
    plan = composed(nodes(EAST, NORTH, more="  cross_covariance: decoupled\n")).plan
    row = plan.layout.complete(np.zeros(plan.layout.provided))
    Phi, Q, _ = plan.discretised(row, np.zeros(0), np.array(1.0), 0)
    x, y = [0, 2], [1, 3]
    whole = plan.whole.discretised(row, np.zeros(0), np.array(1.0), 0)
    for made, full in zip((Phi, Q), whole[:2], strict=True):
        assert not np.any(made[np.ix_(x, y)]) and not np.any(made[np.ix_(y, x)])
        np.testing.assert_array_equal(made[np.ix_(x, x)], full[np.ix_(x, x)])
    assert plan.subsystems is not None and plan.subsystems.noise == ()
