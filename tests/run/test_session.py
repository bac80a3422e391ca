"""A session that is fed row by row says what a batch run over the same rows says."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import Record
from estimfw.errors import DataError, NumericalError, UsageError
from estimfw.model.nominal import InitialNominal
from estimfw.run.load import load_record
from estimfw.run.run import Collected, run_problem
from estimfw.run.session import Estimate, Session

Example = Callable[..., Problem]
AIDED = (
    "policies=[]", "nominal.samples=2", "source.rate=100 Hz", "source.duration=2 s", "source.velocity_noise=0.1 m/s",
    "measurements.zero_velocity={kind: sins_static.zero_velocity, noise: 0.05 m/s/sqrt(Hz), reference: velocity_reference}",
    "estimator={kind: kalman, loop: closed, gate: 0.95}",
)  # fmt: skip


def fed(problem: Problem, record: Record, periods: bool = True) -> list[Estimate]:
    """All estimates of a session that gets the rows of a record in the order of their time."""
    driver = problem.provider.stream
    known = {n: s.period for n, s in record.streams.items() if s.period} if periods else {}
    start = InitialNominal({"C_bn": record.initial["C_bn"]}) if "C_bn" in record.initial else None
    session = Session(problem, start, periods=known)
    rows = sorted((t, n != driver, n, k) for n, s in record.streams.items() for k, t in enumerate(s.time))
    estimates: list[Estimate] = []
    if driver is None:
        for t, _, name, k in rows:
            session.measure(name, t, record.streams[name].values[k])
        for t in sorted({t for t, *_ in rows}):
            estimates.append(session.advance(t))
        return estimates
    for t, _, name, k in [r for r in rows if r[1]]:
        session.measure(name, t, record.streams[name].values[k])
    for t, values in zip(record.streams[driver].time, record.streams[driver].values, strict=True):
        if (estimate := session.push(t, values)) is not None:
            estimates.append(estimate)
    return estimates


def assert_equal(estimates: Sequence[Estimate], run: Collected) -> None:
    """To 1e-12 of a sigma or of the value, at the end of each step that the session reports."""
    time = run.prepared.steps.time
    index = [int(np.argmin(np.abs(time - e.time))) for e in estimates]
    states = np.array([[v for v, _ in e.states.values()] for e in estimates])
    sigma = np.array([[s for _, s in e.states.values()] for e in estimates])
    outputs = np.array([[v for v, _ in e.outputs.values()] for e in estimates])
    np.testing.assert_allclose([e.time for e in estimates], time[index], rtol=1e-15)
    np.testing.assert_allclose(sigma, run.sigma[index], rtol=1e-12)
    assert np.max(np.abs(states - run.estimate[index]) / np.maximum(sigma, np.abs(states))) < 1e-12
    assert np.max(np.abs(outputs - run.output[index]), initial=0.0) < 1e-12
    words = ("fused", "gated", "late", "missing", "invalid")
    for e, k in zip(estimates, index, strict=True):
        for j, m in enumerate(run.prepared.plan.measurements):
            code = run.disposition[k, j]
            assert e.dispositions.get(m.name) == (None if code < 0 else words[code])


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("covariance", ["ud", "joseph"])
def test_an_imu_with_a_velocity_aid_equals_the_batch_run(example: Example, kernel: str, covariance: str) -> None:
    problem = example("static_12", *AIDED, f"estimator.kernel={kernel}", f"estimator.covariance={covariance}")
    record = load_record(problem)
    run = run_problem(problem, record=record)
    estimates = fed(problem, record)
    assert len(estimates) == len(run.prepared.steps) == 100
    assert run.prepared.scan.name == kernel
    assert_equal(estimates, run)


def test_an_aid_at_another_rate_with_gaps_and_missing_components_equals_the_batch_run(example: Example) -> None:
    problem = example("static_12", *AIDED)
    record = load_record(problem)
    aid = record.streams["velocity_reference"]
    values, keep = aid.values.copy(), np.arange(6, 200, 7)
    values[keep[3], 1] = np.nan
    values[keep[5]] = np.nan
    slow = type(aid)(aid.name, aid.time[keep] + 0.0013, values[keep], aid.columns, "sample", 0.07)
    keep = np.delete(np.arange(len(slow)), [8, 9])
    gappy = type(aid)(aid.name, slow.time[keep], slow.values[keep], aid.columns, "sample", 0.07)
    record = Record({**record.streams, aid.name: gappy}, record.truth, initial=record.initial)
    run = run_problem(problem, record=record)
    assert set(np.unique(run.disposition)) >= {-1, 0, 3}
    assert_equal(fed(problem, record), run)


@pytest.mark.parametrize("name", ["static_12", "static_7"])
def test_a_simulated_alignment_with_staged_restarts_equals_the_batch_run(example: Example, name: str) -> None:
    problem = example(name, "source.duration=100 s", "estimator.restarts=[20 s, 50.4 s]", "source.rate=2 Hz")
    record = load_record(problem)
    run = run_problem(problem, record=record)
    assert run.prepared.steps.restart.sum() == 2
    assert_equal(fed(problem, record), run)


@pytest.mark.parametrize("periods", [True, False])
def test_a_tracker_equals_the_batch_run(example: Example, periods: bool) -> None:
    problem = example("tracker", "estimator.restarts=[40.1 s]")
    record = load_record(problem)
    run = run_problem(problem, record=record)
    assert_equal(fed(problem, record, periods), run)


def test_a_known_input_that_changes_between_rows_equals_the_batch_run(example: Example) -> None:
    # 301.7 s lies between two rows: there is a step to it.
    steps = "[{time: 0 s, value: 0 W}, {time: 301.7 s, value: 5 W}, {time: 1500 s, value: 2 W}]"
    problem = example("thermal", f"inputs.heater.steps={steps}", "source.duration=2000 s")
    record = load_record(problem)
    run = run_problem(problem, record=record)
    assert 301.7 in run.prepared.steps.time
    assert_equal(fed(problem, record), run)


def test_one_advance_over_many_rows_is_all_their_steps(example: Example) -> None:
    problem = example("tracker", "source.duration=10 s")
    record = load_record(problem)
    session = Session(problem)
    for name, stream in record.streams.items():
        for t, values in zip(stream.time, stream.values, strict=True):
            session.measure(name, t, values)
    run = run_problem(problem, record=record)
    assert_equal([session.advance(10.0)], run)
    assert session.counts["fix"] == {"fused": 20, "gated": 0, "late": 0, "missing": 0, "invalid": 0}


def test_stiff_dynamics_are_sub_stepped_in_a_session_too(composed: Callable[[str], Problem]) -> None:
    problem = composed(
        "estimfw: 1\nblocks: {x: {kind: gauss_markov, unit: m, sigma: 1 m, steady_sigma: 2 m, correlation_time: 1 ms}}\n"
        "measurements: {z: {kind: direct, of: [{block: x}], noise: 1 m}}\n"
        "source: {kind: simulate_model, duration: 20 s, rate: 0.2 Hz}"
    )
    record = load_record(problem)
    run = run_problem(problem, record=record)
    estimates = fed(problem, record)
    assert_equal(estimates, run)
    assert estimates[0].states["x"][1] == pytest.approx(np.sqrt(4.0 / 5.0), rel=1e-9)


def test_a_row_that_comes_too_late_is_counted_and_never_fused(example: Example) -> None:
    problem = example("tracker")
    late, punctual = Session(problem), Session(problem)
    for session in (late, punctual):
        session.measure("fix", 1.0, [10.0, 20.0])
        session.advance(1.0)
    late.measure("fix", 0.5, [500.0, 500.0])
    for session in (late, punctual):
        session.measure("speed", 1.5, [3.0])
    first, second = late.advance(1.5), punctual.advance(1.5)
    assert first.states == second.states
    assert first.dispositions == {"fix": "late", "speed": "fused"}
    assert second.dispositions == {"speed": "fused"}
    assert late.counts["fix"] == {"fused": 1, "gated": 0, "late": 1, "missing": 0, "invalid": 0}
    (event,) = late.events
    assert (event.kind, event.source, event.time) == ("late", "fix", 0.5)
    assert "the filter was at 1 s already: not fused" in event.text
    assert late.advance(2.0).dispositions == {}


def test_rows_may_come_out_of_order_until_their_instant_has_passed(example: Example) -> None:
    problem = example("tracker")
    one, other = Session(problem), Session(problem)
    rows = [(0.5, [1.0, 2.0]), (1.0, [2.0, 1.0]), (1.5, [3.0, 3.0])]
    for session, order in ((one, rows), (other, rows[::-1])):
        for t, values in order:
            session.measure("fix", t, values)
    assert one.advance(1.5).states == other.advance(1.5).states


def test_of_several_rows_in_a_step_the_last_is_used_and_the_others_are_counted(example: Example) -> None:
    problem = example("static_12", *AIDED)
    record = load_record(problem)
    imu, C = record.streams["imu"], InitialNominal({"C_bn": record.initial["C_bn"]})
    crowded, alone = Session(problem, C, periods={"imu": 0.01}), Session(problem, C, periods={"imu": 0.01})
    crowded.measure("velocity_reference", 0.003, [9.0, 9.0, 9.0])
    for session in (crowded, alone):
        session.measure("velocity_reference", 0.015, [0.01, 0.02, 0.0])
    final = [[s.push(t, v) for t, v in zip(imu.time[:2], imu.values[:2], strict=True)][1] for s in (crowded, alone)]
    assert [e.kind for e in crowded.events] == ["crowded"]
    # The noise is a density: what stands between two rows is the interval, so only that differs.
    assert final[0] is not None and final[1] is not None
    assert final[0].dispositions == final[1].dispositions == {"zero_velocity": "fused"}


def test_an_identical_row_is_used_once_and_a_differing_one_refused(example: Example) -> None:
    session = Session(example("tracker"))
    session.measure("fix", 1.0, [1.0, 2.0])
    session.measure("fix", 1.0, [1.0, 2.0])
    assert [e.kind for e in session.events] == ["duplicate"]
    with pytest.raises(DataError, match="two rows have one time, 1 s, but differ"):
        session.measure("fix", 1.0, [1.0, 2.5])


def test_measurements_that_share_a_stream_each_read_their_columns(composed: Callable[[str], Problem]) -> None:
    problem = composed(
        "estimfw: 1\nblocks: {p: {kind: random_constant, unit: m, axes: [x, y], sigma: 5 m}}\nmeasurements:\n"
        "  first: {kind: direct, of: [{block: p, axes: [x]}], stream: gps, columns: [east], noise: 1 m}\n"
        "  second: {kind: direct, of: [{block: p, axes: [y]}], stream: gps, columns: [north], noise: 1 m}\n"
    )
    session = Session(problem)
    session.measure("gps", 1.0, {"north": 20.0, "east": 10.0})
    estimate = session.advance(1.0)
    # The closed form of one reading: P / (P + R) z.
    assert estimate.states["p[x]"] == pytest.approx((10.0 * 25 / 26, np.sqrt(25 / 26)), rel=1e-12)
    assert estimate.states["p[y]"] == pytest.approx((20.0 * 25 / 26, np.sqrt(25 / 26)), rel=1e-12)
    with pytest.raises(DataError, match=r"got the columns east[\s\S]*due are: east, north"):
        session.measure("gps", 2.0, {"east": 1.0})


def test_a_row_at_the_start_is_fused_without_a_prediction(example: Example) -> None:
    session = Session(example("tracker"))
    session.measure("fix", 0.0, [10.0, 0.0])
    estimate = session.advance(0.0)
    assert estimate.states["position[x]"] == pytest.approx((10 * 2500 / 2509, np.sqrt(2500 * 9 / 2509)), rel=1e-12)
    assert estimate.states["velocity[x]"] == pytest.approx((0.0, 5.0))


@pytest.mark.parametrize("time", [1.0, 0.5, np.nan])
def test_time_must_advance(example: Example, time: float) -> None:
    session = Session(example("tracker"))
    session.advance(1.0)
    with pytest.raises(DataError, match="time does not advance"):
        session.advance(time)


def test_time_of_an_imu_must_advance_and_its_rows_be_whole(example: Example) -> None:
    session = Session(example("static_12", *AIDED), InitialNominal({"C_bn": np.eye(3)}))
    session.push(0.01, np.zeros(6))
    with pytest.raises(DataError, match=r"time does not advance: 0.01 s after 0.01 s"):
        session.push(0.01, np.zeros(6))
    for row in ([0.0, 0.0, 0.0, 0.0, 0.0, np.nan], np.zeros(5)):
        with pytest.raises(DataError, match=r"0.02 s is not 6 finite numbers[\s\S]*dtheta_x, dtheta_y"):
            session.push(0.02, row)


def test_each_way_to_drive_a_session_names_the_other(example: Example) -> None:
    with pytest.raises(UsageError, match=r"driven by a stream[\s\S]*push"):
        Session(example("static_12", *AIDED), InitialNominal({"C_bn": np.eye(3)})).advance(1.0)
    tracker = Session(example("tracker"))
    with pytest.raises(UsageError, match=r"no driving stream[\s\S]*advance"):
        tracker.push(1.0, [1.0])
    with pytest.raises(UsageError, match=r"nothing reads the stream 'gps'[\s\S]*fix, speed"):
        tracker.measure("gps", 1.0, [1.0])
    with pytest.raises(DataError, match=r"1 values where 2 are due[\s\S]*in the order x, y"):
        tracker.measure("fix", 1.0, [1.0])
    assert tracker.estimate is None


def test_numbers_that_overflow_stop_a_session(composed: Callable[[str], Problem]) -> None:
    problem = composed(
        "estimfw: 1\nblocks: {x: {kind: random_constant, unit: m, sigma: 1 m, mean: 1 m}}\n"
        "process: {growth: {kind: couple, target: x, source: x, coefficient: 1.0}}\n"
        "measurements: {z: {kind: direct, of: [{block: x}], noise: 1 m}}\n"
    )
    session = Session(problem)
    with np.errstate(all="ignore"), pytest.raises(NumericalError, match=r"left the numbers at step \d+") as caught:
        for k in range(1, 5000):
            session.advance(float(k))
    assert caught.value.exit_code == 6
