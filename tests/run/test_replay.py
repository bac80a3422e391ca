"""Rows that come late: a session that goes back for them says what one says that got them in order, and so does a batch run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import Record
from estimfw.errors import DataError, UsageError
from estimfw.model.nominal import InitialNominal
from estimfw.run.load import load_record
from estimfw.run.run import run_problem
from estimfw.run.session import Estimate, Session

Example = Callable[..., Problem]
FloatArray = NDArray[np.float64]
TRACKER = ("source.duration=5 s", "estimator.gate=0.9")
ALIGNMENT = (
    "policies=[]", "nominal.samples=2", "source.rate=50 Hz", "source.duration=1.2 s", "source.velocity_noise=0.1 m/s",
    "measurements.zero_velocity={kind: sins_static.zero_velocity, noise: 0.05 m/s, reference: velocity_reference}",
    "estimator={kind: kalman, loop: closed, gate: 0.9, restarts: [0.6 s]}",
)  # fmt: skip


def delayed(record: Record, driver: str | None, delay: float, seed: int) -> Record:
    """Most rows come at once, the others up to ``delay`` s late."""
    rng = np.random.default_rng(seed)
    made = {}
    for name, stream in record.streams.items():
        late = delay * rng.random(len(stream)) * (rng.random(len(stream)) < 0.4)
        made[name] = stream if name == driver else replace(stream, arrival=stream.time + late)
    return replace(record, streams=made)


def live(problem: Problem, record: Record, replay: float | None = None) -> tuple[Session, list[Estimate]]:
    """A session that gets each row when it arrives, those of one moment together, the driving stream's last."""
    driver = problem.provider.stream
    start = InitialNominal({"C_bn": record.initial["C_bn"]}) if "C_bn" in record.initial else None
    periods = {n: s.period for n, s in record.streams.items() if s.period}
    session, done, newest = Session(problem, start, periods=periods, replay=replay), list[Estimate](), 0.0
    rows = [
        (float(a), n == driver, float(t), n, k)
        for n, s in record.streams.items()
        for k, (a, t) in enumerate(zip(s.arrival if s.arrival is not None else s.time, s.time, strict=True))
    ]
    for moment in sorted({a for a, *_ in rows}):
        for _, drives, t, name, k in sorted(r for r in rows if r[0] == moment):
            values = record.streams[name].values[k]
            if drives:
                estimate = session.push(t, values)
                done += [estimate] if estimate is not None else []
            else:
                session.measure(name, t, values)
                newest = max(newest, t)
        if driver is None and newest > session.time + 1e-9:
            done.append(session.advance(newest))
    return session, done


def assert_same(one: Estimate | None, other: Estimate | None) -> None:
    """To 1e-12 of a sigma."""
    assert one is not None
    assert other is not None
    assert one.time == pytest.approx(other.time, abs=1e-12)
    for label, (value, sigma) in one.states.items():
        assert abs(value - other.states[label][0]) <= 1e-12 * max(sigma, abs(value))
    np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-12, atol=1e-30)
    for label, (value, sigma) in one.outputs.items():
        assert abs(value - other.outputs[label][0]) <= 1e-12 * max(sigma, abs(value))


def of_kind(session: Session, kind: str) -> list[tuple[str, float]]:
    return sorted((e.source, e.time) for e in session.events if e.kind == kind)


@given(seed=st.integers(0, 10_000), delay=st.floats(0.1, 4.0))
@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_tracker_whose_rows_come_late_ends_as_one_that_got_them_in_order(
    example: Example, seed: int, delay: float
) -> None:
    problem = example("tracker", *TRACKER)
    record = load_record(problem)
    in_order, _ = live(problem, record)
    session, _ = live(problem, delayed(record, None, delay, seed), replay=4.5)
    assert_same(session.estimate, in_order.estimate)
    assert session.counts == in_order.counts
    assert of_kind(session, "late") == []
    assert len(of_kind(session, "replayed")) > 0


@pytest.mark.parametrize(("kernel", "seed"), [("numpy", 1), ("numba", 2)])
def test_an_imu_in_closed_loop_with_restarts_ends_as_one_that_got_its_aid_in_order(
    example: Example, kernel: str, seed: int
) -> None:
    problem = example("static_12", *ALIGNMENT, f"estimator.kernel={kernel}")
    record = load_record(problem)
    in_order, steps = live(problem, record)
    session, again = live(problem, delayed(record, "imu", 0.3, seed), replay=0.35)
    assert_same(session.estimate, in_order.estimate)
    assert session.counts == in_order.counts
    assert len(again) == len(steps) == 30
    assert len(of_kind(session, "replayed")) > 5


@given(seed=st.integers(0, 10_000), replay=st.floats(0.0, 4.0))
@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_batch_run_on_a_log_with_arrivals_is_what_a_live_session_was(
    example: Example, seed: int, replay: float
) -> None:
    """Rows beyond the window are late in both, and fused in neither."""
    problem = example("tracker", *TRACKER, f"estimator.replay={replay!r} s")
    record = delayed(load_record(problem), None, 4.0, seed)
    session, _ = live(problem, record)
    run = run_problem(problem, record=record)
    assert session.estimate is not None
    assert session.time == run.prepared.steps.time[-1]
    values = np.array([v for v, _ in session.estimate.states.values()])
    np.testing.assert_allclose(values, run.estimate[-1], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.sqrt(np.diag(session.estimate.covariance)), run.sigma[-1], rtol=1e-12)
    for j, m in enumerate(run.prepared.plan.measurements):
        own = {"fused": 0, "gated": 1, "late": 2, "missing": 3, "invalid": 4}
        assert session.counts[m.name] == {word: int(np.sum(run.disposition[:, j] == c)) for word, c in own.items()}
    late = sum(e.count for e in run.events if e.kind == "late")
    assert late == len(of_kind(session, "late"))
    assert sum(e.count for e in run.events if e.kind == "replayed") == len(of_kind(session, "replayed"))


@pytest.mark.parametrize("replay", [0.0, 0.1, 0.35])
def test_a_driven_batch_run_on_a_log_with_arrivals_is_what_a_live_session_was(example: Example, replay: float) -> None:
    problem = example("static_12", *ALIGNMENT, f"estimator.replay={replay} s")
    record = delayed(load_record(problem), "imu", 0.3, 5)
    session, done = live(problem, record)
    run = run_problem(problem, record=record)
    assert len(done) == len(run.prepared.steps)
    assert session.estimate is not None
    assert np.max(np.abs(np.array([v for v, _ in session.estimate.outputs.values()]) - run.output[-1])) < 1e-12
    np.testing.assert_allclose(np.sqrt(np.diag(session.estimate.covariance)), run.sigma[-1], rtol=1e-12)
    late = sum(e.count for e in run.events if e.kind == "late")
    assert late == len(of_kind(session, "late"))
    assert (late == 0) == (replay == 0.35)


def test_a_row_beyond_the_window_is_late_and_changes_nothing(example: Example) -> None:
    problem = example("tracker")
    sessions = [Session(problem, replay=2.0) for _ in range(3)]
    for session in sessions:
        for t in (1.0, 2.0, 3.0, 4.0):
            session.measure("fix", t, [10.0 * t, 2.0])
            session.advance(t)
    beyond, within, none = sessions
    beyond.measure("fix", 1.5, [500.0, 500.0])
    within.measure("fix", 2.5, [26.0, 1.0])
    assert_same(beyond.estimate, none.estimate)
    assert of_kind(beyond, "late") == [("fix", 1.5)]
    assert beyond.counts["fix"]["late"] == 1
    assert of_kind(within, "replayed") == [("fix", 2.5)]
    assert within.counts["fix"] == {"fused": 5, "gated": 0, "late": 0, "missing": 0, "invalid": 0}
    told = next(e.text for e in within.events if e.kind == "replayed")
    assert told == "came when the filter was at 4 s already: gone back, and fused at its instant"


def test_a_row_that_comes_again_is_a_duplicate_and_one_that_differs_is_refused_and_changes_nothing(
    example: Example,
) -> None:
    session = Session(example("tracker"), replay=5.0)
    for t in (1.0, 2.0, 3.0):
        session.measure("fix", t, [t, 0.0])
        session.advance(t)
    before = session.estimate
    session.measure("fix", 2.0, [2.0, 0.0])
    assert of_kind(session, "duplicate") == [("fix", 2.0)]
    with pytest.raises(DataError, match="two rows have one time, 2 s, but differ"):
        session.measure("fix", 2.0, [2.0, 1.0])
    assert session.estimate is before


def test_a_late_reading_of_a_known_input_is_used_from_its_instant_on(composed: Callable[[str], Problem]) -> None:
    """x' = u with u held: the closed form is the area under it."""
    problem = composed(
        "estimfw: 1\nblocks: {x: {kind: random_constant, unit: m, sigma: 1 m}}\n"
        "inputs: {push: {kind: measured, unit: m/s, stream: drive, columns: [v]}}\n"
        "process: {drive: {kind: couple, target: x, source: push, coefficient: 1}}\n"
        "measurements: {z: {kind: direct, of: [{block: x}], noise: 1000 m}}\n"
    )
    session = Session(problem, replay=10.0)
    session.measure("drive", 0.0, [1.0])
    session.advance(1.0)
    session.measure("drive", 3.0, [5.0])
    for t in (2.0, 3.0, 4.0):
        session.advance(t)
    assert session.estimate is not None
    assert session.estimate.states["x"][0] == pytest.approx(3.0 + 5.0)
    session.measure("drive", 1.5, [2.0])
    assert session.estimate.states["x"][0] == pytest.approx(1.5 + 2.0 * 1.5 + 5.0)


def test_what_is_kept_is_bounded_by_the_window(example: Example) -> None:
    session = Session(example("tracker"), replay=3.0)
    kept = []
    for k in range(1, 41):
        session.measure("fix", 0.5 * k, [0.5 * k, 0.0])
        session.advance(0.5 * k)
        assert session._history is not None
        kept.append(len(session._history))
    assert max(kept) == kept[-1] == 7


def test_recovery_is_undone_with_the_step_that_asked_for_it(example: Example) -> None:
    """Ten fixes that are refused in a row restart the filter; a good one among them, late, takes that back."""
    problem = example("tracker", "health={rejected: {then: restart, times: 4}}", "estimator.gate=0.999")
    rows = [(t, [3.0 * t, 2.0]) for t in np.arange(1.0, 11.0)] + [(t, [1e4, 2.0]) for t in np.arange(11.0, 15.0)]
    good = (12.5, [37.5, 2.0])
    late, punctual = Session(problem, replay=5.0), Session(problem, replay=5.0)
    for t, values in rows:
        late.measure("fix", t, values)
        late.advance(t)
    assert of_kind(late, "recovery") == [("fix", 14.0)]
    late.measure("fix", *good)
    for t, values in sorted([*rows, good], key=lambda row: row[0]):
        punctual.measure("fix", t, values)
        punctual.advance(t)
    assert of_kind(late, "recovery") == of_kind(punctual, "recovery") == []
    assert_same(late.estimate, punctual.estimate)
    assert_same(late.advance(15.0), punctual.advance(15.0))


def test_a_session_that_smooths_does_not_go_back(example: Example) -> None:
    problem = example("tracker", "estimator.smoother={kind: fixed_lag, lag: 2 s}")
    with pytest.raises(UsageError, match="a session that smooths cannot go back"):
        Session(problem, replay=5.0)
