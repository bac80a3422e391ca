"""The smoother of a run: what it must equal, where it is cut, and what it gains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError, UsageError
from estimfw.montecarlo.draw import draw_runs
from estimfw.run import run as runner
from estimfw.run import smoothing
from estimfw.run.answer import answer
from estimfw.run.dataset import result_dataset
from estimfw.run.load import load_record
from estimfw.run.run import Collected, run_problem
from estimfw.run.session import Session
from estimfw.run.smoothing import Smoothed
from estimfw.run.until import until

Example = Callable[..., Problem]
FloatArray = NDArray[np.float64]
INTERVAL = "estimator.smoother={kind: fixed_interval}"
CLOSED = (
    "policies=[]", "nominal.samples=2", "source.rate=100 Hz", "source.duration=1.2 s", "source.velocity_noise=0.1 m/s",
    "measurements.zero_velocity={kind: sins_static.zero_velocity, noise: 0.05 m/s/sqrt(Hz), reference: velocity_reference}",
    "estimator={kind: kalman, loop: closed, gate: 0.95}",
)  # fmt: skip


def lag(seconds: float) -> str:
    return f"estimator.smoother={{kind: fixed_lag, lag: {seconds} s}}"


def smoothed(run: Collected) -> Smoothed:
    assert run.smoothed is not None
    return run.smoothed


def differing(one: Smoothed, other: Smoothed) -> float:
    """The largest difference of states, sigmas and outputs, in sigmas."""
    sigma = np.where(other.sigma > 0.0, other.sigma, 1.0)
    parts = [np.abs(one.estimate - other.estimate) / sigma, np.abs(one.sigma - other.sigma) / sigma]
    if other.output.size:
        parts += [np.abs(one.output - other.output) / other.output_sigma, one.output_sigma / other.output_sigma - 1.0]
    return float(max(np.max(np.abs(part)) for part in parts))


def cut(record: Record, end: float) -> Record:
    """The rows up to an instant (s)."""
    streams = {}
    for name, s in record.streams.items():
        keep = s.time <= end + 1e-9
        streams[name] = Stream(name, s.time[keep], s.values[keep], s.columns, s.kind, s.period)
    return replace(record, streams=streams)


@pytest.mark.parametrize("how", [INTERVAL, lag(3.0)])
@pytest.mark.parametrize("size", [1, 7, 50])
def test_chunks_do_not_matter(example: Example, monkeypatch: pytest.MonkeyPatch, how: str, size: int) -> None:
    problem = example("tracker", "source.duration=12 s", "estimator.restarts=[6 s]", how)
    whole = smoothed(run_problem(problem))
    monkeypatch.setattr(runner, "LONGEST_CHUNK", size)
    pieces = smoothed(run_problem(problem))
    np.testing.assert_allclose(pieces.estimate, whole.estimate, rtol=1e-12)
    assert differing(pieces, whole) < 1e-12


def test_links_on_disk_are_those_in_memory(example: Example, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = example("tracker", "source.duration=12 s", INTERVAL)
    monkeypatch.setattr(runner, "LONGEST_CHUNK", 9)
    kept = smoothed(run_problem(problem))
    monkeypatch.setattr(smoothing, "IN_MEMORY", 2000)
    np.testing.assert_array_equal(smoothed(run_problem(problem)).estimate, kept.estimate)


@pytest.mark.parametrize("name", ["tracker", "thermal", "static_12", "static_7"])
@pytest.mark.parametrize("how", [INTERVAL, lag(20.0)])
def test_factors_and_joseph_are_one_smoother(example: Example, name: str, how: str) -> None:
    runs = [
        run_problem(example(name, "source.duration=40 s", how, f"estimator.covariance={covariance}"))
        for covariance in ("ud", "joseph")
    ]
    assert differing(*map(smoothed, runs)) < 1e-6
    assert np.max(smoothed(runs[0]).sigma / runs[0].sigma) < 1.0 + 1e-9


@pytest.mark.parametrize(("name", "more"), [("tracker", ()), ("static_12", ()), ("static_12", CLOSED)])
def test_a_lag_as_long_as_the_record_is_the_fixed_interval(example: Example, name: str, more: tuple[str, ...]) -> None:
    short = () if more else ("source.duration=60 s",)
    whole, lagged = (smoothed(run_problem(example(name, *short, *more, how))) for how in (INTERVAL, lag(1000.0)))
    assert differing(lagged, whole) < 1e-9


@pytest.mark.parametrize("seconds", [0.1, 2.5, 7.0])
def test_each_state_of_a_fixed_lag_is_smoothed_by_the_data_up_to_the_lag_after_it(
    example: Example, seconds: float
) -> None:
    # Brute force: a record for each, that ends with the first step that is so much later, smoothed over its interval.
    problem = example("tracker", "source.duration=20 s", "estimator.restarts=[9 s]", lag(seconds))
    record = load_record(problem)
    run = run_problem(problem, record=record)
    time, lagged = run.prepared.steps.time, smoothed(run)
    every = example("tracker", "source.duration=20 s", "estimator.restarts=[9 s]", INTERVAL)
    for j in range(5, len(time), 27):
        end = min(int(np.searchsorted(time, time[j] + seconds - 1e-6)), len(time) - 1)
        brute = smoothed(run_problem(every, record=cut(record, float(time[end]))))
        assert len(brute.estimate) == end + 1
        assert np.max(np.abs(lagged.estimate[j] - brute.estimate[j]) / brute.sigma[j]) < 1e-9
        np.testing.assert_allclose(lagged.sigma[j], brute.sigma[j], rtol=1e-9)


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize(("name", "more"), [("tracker", ("source.duration=12 s",)), ("static_12", CLOSED)])
def test_a_session_says_what_the_run_says(example: Example, name: str, more: tuple[str, ...], kernel: str) -> None:
    seconds = 0.5 if more is CLOSED else 2.5
    problem = example(name, *more, f"estimator.kernel={kernel}", lag(seconds))
    record = load_record(problem)
    run = run_problem(problem, record=record)
    estimates = fed(problem, record)
    told = [one for estimate in estimates for one in estimate.smoothed]
    time, batch = run.prepared.steps.time, smoothed(run)
    passed = int(np.sum(time <= time[-1] - seconds + 1e-9))
    assert len(told) == passed > 10
    np.testing.assert_allclose([one.time for one in told], time[:passed], rtol=1e-15)
    values = np.array([[value for value, _ in one.states.values()] for one in told])
    sigmas = np.array([[sigma for _, sigma in one.states.values()] for one in told])
    assert np.max(np.abs(values - batch.estimate[:passed]) / sigmas) < 1e-9
    np.testing.assert_allclose(sigmas, batch.sigma[:passed], rtol=1e-9)
    outputs = np.array([[value for value, _ in one.outputs.values()] for one in told])
    assert np.max(np.abs(outputs - batch.output[:passed]), initial=0.0) < 1e-9


def fed(problem: Problem, record: Record) -> list[Any]:
    """All estimates of a session that gets the rows of a record in the order of their time."""
    driver = problem.provider.stream
    start = record.initial if "C_bn" in record.initial else None
    session = Session(problem, None if start is None else _started(record), periods=_periods(record))
    rows = sorted((t, n, k) for n, s in record.streams.items() if n != driver for k, t in enumerate(s.time))
    for t, name, k in rows:
        session.measure(name, t, record.streams[name].values[k])
    if driver is None:
        return [session.advance(t) for t in sorted({t for t, *_ in rows})]
    imu = record.streams[driver]
    pushed = (session.push(t, values) for t, values in zip(imu.time, imu.values, strict=True))
    return [estimate for estimate in pushed if estimate is not None]


def _started(record: Record) -> Any:
    from estimfw.model.nominal import InitialNominal

    return InitialNominal({"C_bn": record.initial["C_bn"]})


def _periods(record: Record) -> dict[str, float]:
    return {n: s.period for n, s in record.streams.items() if s.period}


def test_a_session_cannot_smooth_over_the_whole_record(example: Example) -> None:
    with pytest.raises(UsageError, match=r"interval that has not ended[\s\S]*fixed_lag"):
        Session(example("tracker_smoothed"))


def test_a_restart_cuts_the_smoother(example: Example) -> None:
    problem = example("tracker", "source.duration=20 s", "estimator={kind: kalman, restarts: [10 s]}", INTERVAL)
    record = load_record(problem)
    run = run_problem(problem, record=record)
    at = int(np.flatnonzero(run.prepared.steps.restart)[0])
    before = smoothed(run_problem(problem, record=cut(record, float(run.prepared.steps.time[at - 1]))))
    np.testing.assert_allclose(smoothed(run).estimate[:at], before.estimate, rtol=1e-12)
    np.testing.assert_array_equal(smoothed(run).estimate[at - 1], run.estimate[at - 1])
    assert np.all(smoothed(run).sigma[at, [0, 1, 3]] < 0.2 * run.sigma[at, [0, 1, 3]])


def test_closed_loop_is_smoothed_as_open_loop_where_tilts_are_small(example: Example) -> None:
    # The error of linearisation separates the loops: quadratic in the tilt, see test_loops.
    small = (
        "source.misalignment=[0.002 deg, 0.002 deg, 0.002 deg]", "source.duration=100 s", "policies=[]",
        "source.gyro_bias=[0 deg/h, 0 deg/h, 0 deg/h]", "source.accel_bias=[0 ug, 0 ug, 0 ug]", "source.noise=false",
    )  # fmt: skip
    opened, closed = (
        run_problem(
            example(
                "static_12", *small, f"estimator={{kind: kalman, loop: {loop}, smoother: {{kind: fixed_interval}}}}"
            )
        )
        for loop in ("open", "closed")
    )
    one, other = smoothed(opened), smoothed(closed)
    assert np.max(np.abs(opened.output - closed.output)) < 1e-6  # rad
    assert np.max(np.abs(one.output - other.output)) < 1e-6
    np.testing.assert_allclose(one.sigma, other.sigma, rtol=0.02)
    # The error states themselves are of another nominal, and differ by what it was corrected by.
    assert np.max(np.abs(one.estimate[:, 3:6] - other.estimate[:, 3:6])) > 1e-5


def test_the_last_epoch_and_all_answers_are_the_filter_s(example: Example) -> None:
    plain, both = (
        result_dataset(run_problem(example(name, "source.duration=20 s"))) for name in ("tracker", "tracker_smoothed")
    )
    np.testing.assert_array_equal(both["smoothed"].to_numpy()[-1], both["estimate"].to_numpy()[-1])
    one, other = answer(plain), answer(both)
    assert other.pop("smoother")["kind"] == "fixed_interval"
    for told in (one, other):
        del told["provenance"], told["title"]
    assert one == other


def test_a_result_that_is_cut_does_not_know_what_came_after(example: Example) -> None:
    result = result_dataset(run_problem(example("tracker_smoothed", "source.duration=20 s")))
    assert "smoothed" in until(result, 20.0)
    earlier = until(result, 10.0)
    assert not [name for name in earlier.variables if str(name).startswith("smoothed")]
    assert "smoother" not in answer(earlier)


@pytest.mark.parametrize(
    ("estimator", "text"),
    [
        ("{kind: bank, smoother: {kind: fixed_interval}}", "a bank has no smoother"),
        ("{kind: bank, filter: {kind: kalman, smoother: {kind: fixed_interval}}}", "a member of a bank has no smoother"),
        ("{kind: unscented, smoother: {kind: fixed_interval}}", "an unscented filter has no smoother"),
        ("{kind: determination, smoother: {kind: fixed_interval}}", "a determination has no smoother"),
        ("{kind: bank, stages: [{name: all}]}", "a bank has no stages"),
        ("{kind: determination, stages: [{name: all}]}", "a determination has no stages"),
        ("{kind: unscented, stages: [{name: all}]}", "an unscented filter has no stages"),
        ("{kind: decentralised, nodes: [], stages: [{name: all}]}", "a decentralised filter has no stages"),
        ("{kind: kalman, smoother: {kind: fixed_lag}}", "lag"),
        ("{kind: kalman, smoother: {kind: fixed_lag, lag: -1 s}}", "lag"),
        ("{kind: kalman, smoother: {kind: rts}}", "fixed_interval"),
    ],
)  # fmt: skip
def test_what_cannot_be_smoothed_is_refused_in_words(example: Example, estimator: str, text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        example("tracker", f"estimator={estimator}")


@pytest.mark.parametrize(("name", "duration"), [("tracker", "40 s"), ("thermal", "1800 s")])
def test_a_smoother_is_nearer_to_the_truth_in_every_state(example: Example, name: str, duration: str) -> None:
    squares: list[FloatArray] = []
    for seed in range(3):
        run = run_problem(example(name, f"source.seed={seed}", f"source.duration={duration}", INTERVAL))
        assert run.truth is not None
        squares.append(np.mean([(smoothed(run).estimate - run.truth) ** 2, (run.estimate - run.truth) ** 2], axis=1))
    after, before = np.sqrt(np.mean(squares, axis=0))
    assert np.all(after < 0.9 * before)


def test_smoothed_sigmas_are_honest(example: Example) -> None:
    # NEES of 40 runs, at five instants each.
    problem = example("tracker", "source.duration=5 s", "estimator={kind: kalman, smoother: {kind: fixed_interval}}")
    draws, nees = draw_runs(problem, 1, range(40)), []
    for i in range(40):
        run = run_problem(problem, record=draws.run(i))
        assert run.truth is not None
        index = run.covariance_index
        error = smoothed(run).estimate[index] - run.truth[index]
        each = [e @ np.linalg.solve(P, e) for e, P in zip(error, smoothed(run).covariance, strict=True)]
        nees.append(each[:: len(each) // 4])
    assert np.all(np.abs(np.mean(nees, axis=0) - 4.0) < 3.5 * np.sqrt(2 * 4 / 40))


@pytest.mark.parametrize("how", [INTERVAL, lag(2.0)])
@pytest.mark.parametrize(
    ("name", "more"), [("tracker", ("source.duration=30 s",)), ("thermal", ()), ("static_12", CLOSED)]
)
def test_compiled_and_numpy_smoothers_agree(example: Example, name: str, more: tuple[str, ...], how: str) -> None:
    plain, compiled = (
        smoothed(run_problem(example(name, *more, f"estimator.kernel={kernel}", how))) for kernel in ("numpy", "numba")
    )
    assert differing(compiled, plain) < 1e-9


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("static_12", ("estimator.loop=closed", "source.duration=150 s")),
        ("ins_gm9_heading", ("source.duration=1 h",)),
        ("ins_full14", ("source.duration=1 h",)),
    ],
)  # fmt: skip
def test_over_drawn_starts_no_state_is_worse_and_those_are_better_whose_sigma_says_so(
    example: Example, name: str, more: tuple[str, ...]
) -> None:
    problem = example(name, "estimator.kernel=numba", INTERVAL, *more)
    draws, squares, sigmas = draw_runs(problem, 3, range(8)), [], []
    for i in range(8):
        run = run_problem(problem, record=draws.run(i))
        assert run.truth is not None
        squares.append([np.mean((x - run.truth) ** 2, axis=0) for x in (smoothed(run).estimate, run.estimate)])
        sigmas.append([np.mean(sigma**2, axis=0) for sigma in (smoothed(run).sigma, run.sigma)])
    (after, before), (own, filtered) = (np.sqrt(np.mean(each, axis=0)) for each in (squares, sigmas))
    assert np.all(after < 1.02 * before)
    clear = own < 0.6 * filtered
    assert np.sum(clear) >= 3 and np.all(after[clear] < 0.85 * before[clear])
