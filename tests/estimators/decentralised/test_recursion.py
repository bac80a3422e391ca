"""Runs of the decentralised filter against the global one: cuts, orders, silence, gates, loops, restarts, pieces of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import Record
from estimfw.estimators.decentralised.exchange import InProcessExchange
from estimfw.estimators.decentralised.scan import DecentralisedScan
from estimfw.estimators.scan import ChunkResult, FilterState
from estimfw.kernels.fuse import FUSED, GATED, MISSING
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare
from estimfw.run.run import Collected, run_problem
from estimfw.run.session import Session

FloatArray = NDArray[np.float64]
Alignment = Callable[..., Problem]
Nodes = Callable[[Sequence[str]], list[dict[str, object]]]
Example = Callable[..., Problem]

GLOBAL = {"kind": "kalman", "covariance": "joseph", "kernel": "numpy"}
BY_CORRELATION = [
    "velocity[x] tilt accel_bias",
    "velocity[y] azimuth gyro_drift",
]


def decentralised(nodes: list[dict[str, object]], **more: object) -> dict[str, object]:
    return {"kind": "decentralised", "nodes": nodes, **more}


def difference(found: Collected, wanted: Collected) -> float:
    """Largest over the run, of estimates in sigmas, and of covariances in products of sigmas."""
    assert found.prepared.plan.states == wanted.prepared.plan.states
    sigma = wanted.sigma[wanted.covariance_index]
    scale = sigma[:, :, None] * sigma[:, None, :]
    return max(
        float(np.abs((found.estimate - wanted.estimate) / wanted.sigma).max()),
        float(np.abs((found.covariance - wanted.covariance) / scale).max()),
    )


def test_1200_steps_of_alignment_are_those_of_the_global_filter(alignment: Alignment, nodes: Nodes) -> None:
    """1e-9 is the tolerance: two global forms differ by 1e-11 here, for the converged covariance is nearly singular."""
    wanted = run_problem(alignment(GLOBAL))
    found = run_problem(alignment(decentralised(nodes(BY_CORRELATION))))
    assert difference(found, wanted) < 1e-9
    assert np.allclose(found.nis.sum(axis=1), wanted.nis.sum(axis=1), rtol=1e-6)  # in parts, and at once
    assert_published(found)


def assert_published(run: Collected) -> None:
    """Sigmas in m/s, arcmin, ug and deg/h at 60 and 1200 s, the platform turned by 30 deg."""
    minute, ug, per_hour = np.pi / 180.0 / 60.0, 9.80665e-6, np.pi / 180.0 / 3600.0
    unit = np.array([1.0, 1.0, minute, minute, minute, ug, ug, per_hour, per_hour, per_hour])
    published = {
        60: ".0026 .0032 .1877 .1741 42.43 49.98 49.98 .0199 .0199 .0200",
        1200: ".0016 .0016 .1720 .1721 5.892 49.98 49.97 .0173 .0101 .0197",
    }
    for step, text in published.items():
        digits = [len(one.split(".")[1]) for one in text.split()]
        found = [f"{value:.{d}f}" for value, d in zip(run.sigma[step - 1] / unit, digits, strict=True)]
        assert [one.removeprefix("0") for one in found] == text.split()


STATES = [
    "velocity[x]", "velocity[y]", "tilt[x]", "tilt[y]", "azimuth",
    "accel_bias[x]", "accel_bias[y]", "gyro_drift[x]", "gyro_drift[y]", "gyro_drift[z]",
]  # fmt: skip


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    owners=st.lists(st.integers(0, 4), min_size=10, max_size=10), rows=st.tuples(st.integers(0, 4), st.integers(0, 4))
)
def test_any_cut_in_any_order_is_the_global_filter(
    alignment: Alignment, owners: list[int], rows: tuple[int, int]
) -> None:
    """Nodes in the order of their first state; rows go to any node, also to one whose states they do not read."""
    used = list(dict.fromkeys(owners))
    made: list[dict[str, object]] = [
        {
            "name": f"n{node}",
            "blocks": [state for state, owner in zip(STATES, owners, strict=True) if owner == node],
            "measurements": [f"zero_velocity[{'xy'[i]}]" for i in (0, 1) if used[rows[i] % len(used)] == node],
        }
        for node in used
    ]
    wanted, found = run_problem(alignment(GLOBAL, 40)), run_problem(alignment(decentralised(made), 40))
    assert difference(found, wanted) < 1e-9


def without(record: Record, column: int, begin: float, end: float) -> Record:
    """Without the readings of one axis in [begin, end)."""
    stream = record.streams["zero_velocity"]
    values = stream.values.copy()
    values[(stream.time >= begin) & (stream.time < end), column] = np.nan
    return replace(record, streams={"zero_velocity": replace(stream, values=values)})


def test_a_node_silent_from_400_to_500_s_costs_its_measurements_and_nothing_else(
    alignment: Alignment, nodes: Nodes
) -> None:
    problem = alignment(GLOBAL)
    record = load_record(problem)
    wanted = run_problem(problem, record=without(record, 1, 400.0, 500.0))
    exchange = {"silent": [{"node": "n1", "from": "400 s", "until": "500 s"}]}
    found = run_problem(alignment(decentralised(nodes(BY_CORRELATION), exchange=exchange)), record=record)
    time, own = found.prepared.steps.time, [m.name for m in found.prepared.plan.measurements].index("zero_velocity@n1")
    away = (time >= 400.0) & (time < 500.0)
    assert np.all(found.disposition[away, own] == MISSING)
    assert np.all(found.disposition[~away] == FUSED)
    assert difference(found, wanted) < 1e-9
    (event,) = [e for e in found.events if e.kind == "node silent"]
    assert (event.time, event.source, event.kind, event.count) == (400.0, "node n1", "node silent", 100)
    assert "from 400 to 499 s" in event.text and "n0 carried its states on" in event.text
    whole = run_problem(problem, record=record)
    assert difference(found, whole) > 1e-3  # the readings that are missing were worth something


def test_words_of_a_run_are_those_of_its_steps(alignment: Alignment, nodes: Nodes) -> None:
    """89 a step while both answer; none while one is alone; a snapshot of 65 when the other is back."""
    silent = {"silent": [{"node": "n0", "from": "10 s", "until": "20 s"}]}
    found = run_problem(alignment(decentralised(nodes(BY_CORRELATION), exchange=silent), 30))
    assert isinstance(found.prepared.scan, DecentralisedScan)
    assert isinstance(found.prepared.scan.exchange, InProcessExchange)
    ledger = found.prepared.scan.exchange.ledger
    assert (ledger.steps, ledger.total, ledger.rounds) == (30, 20 * 89 + 65, 20 * 3)
    assert ledger.words[1]["snapshot"] == 65
    assert [a.steps for a in ledger.absences] == [10]


def test_two_nodes_of_three_may_be_silent_at_different_times(alignment: Alignment, nodes: Nodes) -> None:
    groups = ["velocity[x] tilt", "velocity[y] azimuth", "accel_bias gyro_drift"]
    silent = [
        {"node": "n0", "from": "20 s", "until": "60 s"},
        {"node": "n1", "from": "50 s", "until": "80 s"},
        {"node": "n2", "from": "30 s", "until": "40 s"},
    ]
    problem = alignment(GLOBAL, 100)
    record = load_record(problem)
    wanted = run_problem(problem, record=without(without(record, 0, 20.0, 60.0), 1, 50.0, 80.0))
    found = run_problem(alignment(decentralised(nodes(groups), exchange={"silent": silent}), 100), record=record)
    assert difference(found, wanted) < 1e-9
    assert sorted((e.source, e.time) for e in found.events if e.kind == "node silent") == [
        ("node n0", 20.0),
        ("node n1", 50.0),
        ("node n2", 30.0),
    ]


def test_where_no_node_answers_the_filter_is_the_global_one_without_any_reading(
    alignment: Alignment, nodes: Nodes
) -> None:
    """From 50 to 60 s both are away: no words; then they have what they had, and need no snapshot."""
    silent = [{"node": "n0", "from": "20 s", "until": "60 s"}, {"node": "n1", "from": "50 s", "until": "80 s"}]
    problem = alignment(GLOBAL, 100)
    record = load_record(problem)
    wanted = run_problem(problem, record=without(without(record, 0, 20.0, 60.0), 1, 50.0, 80.0))
    found = run_problem(
        alignment(decentralised(nodes(BY_CORRELATION), exchange={"silent": silent}), 100), record=record
    )
    assert difference(found, wanted) < 1e-9
    assert isinstance(found.prepared.scan, DecentralisedScan)
    ledger = found.prepared.scan.exchange.ledger
    assert (ledger.steps, ledger.rounds) == (100, (100 - 60) * 3)
    assert [(a.node, a.steps, a.deputies) for a in ledger.absences] == [(0, 40, [1]), (1, 30, [0])]
    assert ledger.total == 40 * 89 + 65


@pytest.mark.parametrize("form", ["exact", "drop"])
def test_a_silent_node_is_one_whose_readings_are_missing_in_a_suboptimal_form_too(
    alignment: Alignment, nodes: Nodes, form: str
) -> None:
    record = load_record(alignment(GLOBAL, 60))
    silent = {"silent": [{"node": "n0", "from": "20 s", "until": "40 s"}]}
    mute = alignment(decentralised(nodes(BY_CORRELATION), cross_covariance=form, exchange=silent), 60)
    holed = alignment(decentralised(nodes(BY_CORRELATION), cross_covariance=form), 60)
    found, wanted = run_problem(mute, record=record), run_problem(holed, record=without(record, 0, 20.0, 40.0))
    assert np.array_equal(found.estimate, wanted.estimate) and np.array_equal(found.disposition, wanted.disposition)
    if form == "drop":
        assert found.honest is not None and wanted.honest is not None
        np.testing.assert_array_equal(found.honest.sigma, wanted.honest.sigma)


def test_gates_are_those_of_a_filter_with_one_measurement_a_node(composed: Callable[[str], Problem]) -> None:
    """Readings that are wrong in one axis are gated there alone, by both filters alike."""
    text = """\
estimfw: 1
blocks:
  position: {kind: random_constant, unit: m, axes: [x, y], sigma: 50 m}
  velocity: {kind: random_walk, unit: m/s, axes: [x, y], sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
  turn: {kind: couple, target: velocity, source: velocity, coefficient: [[0, 0.1], [-0.1, 0]]}
"""
    cut = """\
measurements: {fix: {kind: direct, of: [{block: position}], noise: 3 m}}
source: {kind: simulate_model, duration: 60 s, rate: 2 Hz, seed: 7}
estimator:
  kind: decentralised
  gate: 0.99
  nodes:
    - {name: east, blocks: ["position[x]", "velocity[x]"], measurements: ["fix[x]"]}
    - {name: north, blocks: ["position[y]", "velocity[y]"], measurements: ["fix[y]"]}
"""
    apart = """\
measurements:
  east: {kind: direct, of: [{block: position, axes: [x]}], rows: [x], stream: fix, noise: 3 m}
  north: {kind: direct, of: [{block: position, axes: [y]}], rows: [y], stream: fix, noise: 3 m}
estimator: {kind: kalman, covariance: joseph, gate: 0.99}
"""
    problem = composed(text + cut)
    record = load_record(problem)
    stream = record.streams["fix"]
    stream.values[40:46, 0] += 60.0
    stream.values[70:74, 1] -= 60.0
    found = run_problem(problem, record=record)
    wanted = run_problem(composed(text + apart), record=record)
    assert difference(found, wanted) < 1e-9
    assert np.array_equal(found.disposition, wanted.disposition)
    assert np.all(found.disposition[40:46, 0] == GATED) and np.all(found.disposition[70:74, 1] == GATED)
    np.testing.assert_allclose(found.nis, wanted.nis, rtol=1e-8)
    np.testing.assert_allclose(found.innovation, wanted.innovation, atol=1e-9)
    np.testing.assert_allclose(found.innovation_sigma, wanted.innovation_sigma, rtol=1e-9)


INERTIAL = (
    "policies=[]", "source.rate=10 Hz", "source.duration=20 s",
    "source.misalignment=[1 deg, -1 deg, 2 deg]",
)  # fmt: skip
INERTIAL_NODES = (
    "nodes: [{name: level, blocks: [attitude_error, accel_bias], measurements: []}, "
    "{name: speed, blocks: [velocity_error, gyro_bias], measurements: [zero_velocity]}]"
)


@pytest.mark.parametrize(
    "more", ["loop: closed", "loop: open", "loop: open, restarts: [8 s]", "loop: closed, restarts: [8 s]"]
)
def test_a_moving_nominal_and_both_loops(example: Example, more: str) -> None:
    """Phi anew at every step, the strapdown mechanization corrected by what the nodes know together."""
    settings = "discretisation: {method: series}"
    wanted = run_problem(
        example(
            "static_12", *INERTIAL, f"estimator={{kind: kalman, covariance: joseph, kernel: numpy, {settings}, {more}}}"
        )
    )
    found = run_problem(
        example("static_12", *INERTIAL, f"estimator={{kind: decentralised, {INERTIAL_NODES}, {settings}, {more}}}")
    )
    assert difference(found, wanted) < 1e-9
    assert np.abs(found.output - wanted.output).max() < 1e-12


def in_pieces(problem: Problem, length: int) -> tuple[FloatArray, FloatArray]:
    """Estimates and covariances of a run whose state is handed on every so many steps."""
    prepared = prepare(problem, load_record(problem))
    state: FilterState = prepared.state
    parts: list[ChunkResult] = []
    for first in range(0, len(prepared.steps), length):
        last = min(first + length, len(prepared.steps))
        state, result = prepared.scan.run(state, make_chunk(prepared, first, last))
        parts.append(result)
    return np.concatenate([p.estimate for p in parts]), np.concatenate([p.covariance for p in parts])


@pytest.mark.parametrize("form", ["exact", "drop", "decoupled"])
def test_a_run_in_pieces_is_the_run(alignment: Alignment, nodes: Nodes, form: str) -> None:
    problem = alignment(decentralised(nodes(BY_CORRELATION), cross_covariance=form), 50)
    x, P = in_pieces(problem, 50)
    for length in (1, 7):
        again = in_pieces(problem, length)
        assert np.array_equal(again[0], x) and np.array_equal(again[1], P)


def test_a_session_says_what_the_run_says(alignment: Alignment, nodes: Nodes) -> None:
    exchange = {"silent": [{"node": "n1", "from": "10 s", "until": "15 s"}]}
    problem = alignment(decentralised(nodes(BY_CORRELATION), exchange=exchange), 30)
    record = load_record(problem)
    run = run_problem(problem, record=record)
    session, stream = Session(problem, periods={"zero_velocity": 1.0}), record.streams["zero_velocity"]
    for k, time in enumerate(stream.time):
        session.measure("zero_velocity", float(time), stream.values[k])
        estimate = session.advance(float(time))
        values = np.array([v for v, _ in estimate.states.values()])
        assert np.abs((values - run.estimate[k]) / run.sigma[k]).max() < 1e-12
        assert estimate.dispositions["zero_velocity@n1"] == ("missing" if 10.0 <= time < 15.0 else "fused")
    assert [(e.time, e.source, e.kind) for e in session.events] == [(10.0, "node n1", "node silent")]
