"""A known input that is measured: a battery whose logged current drives its state of charge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import read_document
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError, DataError
from estimfw.registry.load import load_plugins
from estimfw.run.load import load_record
from estimfw.run.run import Collected, run_problem
from estimfw.run.session import Session

FloatArray = NDArray[np.float64]
Composed = Callable[..., Problem]

CAPACITY = 3600.0  # C
BATTERY = """\
estimfw: 1
inputs:
  current: {kind: measured, unit: A, stream: log}
blocks:
  charge: {kind: random_walk, sigma: 0.1, mean: 0.5, noise: 0.001 1/sqrt(s)}
process:
  discharge: {kind: couple, target: charge, source: current, coefficient: -2.777777777777778e-4}
measurements:
  voltage: {kind: direct, of: [{block: charge, coefficient: 0.7}], unit: V, noise: 20 mV, stream: log}
"""
TIME = np.array([0.0, 1.0, 2.5, 3.0, 7.0, 8.0])
CURRENT = np.array([36.0, -18.0, np.nan, 72.0, 0.0, 5.0])
VOLTAGE = np.array([0.36, 0.35, 0.351, 0.34, np.nan, 0.3])


@pytest.fixture(scope="module")
def composed() -> Composed:
    registry = load_plugins(core_components(), [])
    return lambda text=BATTERY: compose(read_document(text), registry)


def logged(current: FloatArray = CURRENT) -> Record:
    return Record({"log": Stream("log", TIME, np.stack([current, VOLTAGE], axis=1), ("current", "voltage"))})


def naive(held: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean and sigma after each row of a scalar filter whose charge falls by the held current."""
    x, P, means, sigmas = 0.5, 0.01, [], []
    for k, z in enumerate(VOLTAGE):
        if k:
            dt = TIME[k] - TIME[k - 1]
            x, P = x - held[k - 1] * dt / CAPACITY, P + 1e-6 * dt
        if np.isfinite(z):
            gain = 0.7 * P / (0.49 * P + 4e-4)
            x, P = x + gain * (z - 0.7 * x), (1.0 - 0.7 * gain) * P
        means.append(x)
        sigmas.append(np.sqrt(P))
    return np.array(means), np.array(sigmas)


def run(problem: Problem, record: Record) -> Collected:
    return run_problem(problem, record=record)


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_each_reading_holds_until_the_next_and_a_missing_one_keeps_the_last(composed: Composed, kernel: str) -> None:
    done = run(composed(f"{BATTERY}estimator: {{kind: kalman, kernel: {kernel}}}\n"), logged())
    mean, sigma = naive(np.array([36.0, -18.0, -18.0, 72.0, 0.0, 5.0]))
    np.testing.assert_array_equal(done.prepared.steps.time, TIME)
    np.testing.assert_allclose(done.estimate[:, 0], mean, rtol=1e-12)
    np.testing.assert_allclose(done.sigma[:, 0], sigma, rtol=1e-12)
    held = [e for e in done.prepared.events if "held" in e.text]
    assert [(e.time, e.source, e.kind, e.count) for e in held] == [(2.5, "log", "missing", 1)]


def test_before_the_first_reading_zero_is_taken_and_told(composed: Composed) -> None:
    current = np.array([np.nan, np.nan, 10.0, 72.0, 0.0, 5.0])
    done = run(composed(), logged(current))
    mean, _ = naive(np.array([0.0, 0.0, 10.0, 72.0, 0.0, 5.0]))
    np.testing.assert_allclose(done.estimate[:, 0], mean, rtol=1e-12)
    assert "no reading of the input current before 2.5 s: zero is taken" in [e.text for e in done.prepared.events]


def test_readings_of_their_own_stream_make_steps_of_their_own(composed: Composed) -> None:
    """A current at other instants than the voltage: exact, though nothing is measured there."""
    text = BATTERY.replace("unit: A, stream: log", "unit: A, columns: [i]").replace(", stream: log", "")
    current = Stream("current", np.array([0.0, 0.25]), np.array([[100.0], [300.0]]), ("i",))
    voltage = Stream("voltage", np.array([0.0, 1.0]), np.array([[np.nan], [np.nan]]), ("voltage",))
    done = run(composed(text), Record({"current": current, "voltage": voltage}))
    assert done.prepared.steps.time.tolist() == [0.0, 0.25, 1.0]
    assert done.estimate[-1, 0] == pytest.approx(0.5 - (0.25 * 100.0 + 0.75 * 300.0) / CAPACITY, rel=1e-14)


def test_the_plan_does_not_know_the_readings(composed: Composed) -> None:
    problem = composed()
    before = problem.plan.hash
    run(problem, logged())
    assert problem.plan.hash == before == composed().plan.hash
    assert problem.plan.inputs[0].values == ()
    assert problem.plan.time_invariant


def test_a_session_that_gets_the_rows_says_the_same(composed: Composed) -> None:
    problem, record = composed(), logged()
    batch, session = run(problem, record), Session(problem)
    for k, t in enumerate(TIME):
        session.measure("log", t, {"current": CURRENT[k], "voltage": VOLTAGE[k]})
        estimate = session.advance(t)
        value, sigma = estimate.states["charge"]
        assert value == pytest.approx(batch.estimate[k, 0], abs=1e-12 * sigma)
        assert sigma == pytest.approx(batch.sigma[k, 0], rel=1e-12)


def test_a_session_that_goes_on_without_rows_holds_the_last_reading(composed: Composed) -> None:
    session = Session(composed())
    session.measure("log", 0.0, {"current": 36.0, "voltage": np.nan})
    session.measure("log", 3.0, {"current": 72.0, "voltage": np.nan})  # known ahead: holds from then on
    session.advance(2.0)
    assert session.advance(5.0).states["charge"][0] == pytest.approx(0.5 - (3 * 36.0 + 2 * 72.0) / CAPACITY, rel=1e-14)
    assert session.advance(6.0).states["charge"][0] == pytest.approx(0.5 - (3 * 36.0 + 3 * 72.0) / CAPACITY, rel=1e-14)


def test_a_log_is_read_for_it_in_its_unit(composed: Composed, tmp_path: Path) -> None:
    rows = zip(TIME, CURRENT * 1000.0, VOLTAGE, strict=True)
    lines = [f"{t},{'' if np.isnan(i) else i},{'' if np.isnan(v) else v}" for t, i, v in rows]
    (tmp_path / "a.csv").write_text("time,current,voltage\n" + "\n".join(lines) + "\n")
    source = f"source: {{kind: log, streams: {{log: {{file: {tmp_path / 'a.csv'}, units: {{current: mA}}}}}}}}\n"
    problem = composed(BATTERY + source)
    done = run(problem, load_record(problem))
    np.testing.assert_allclose(done.estimate, run(composed(), logged()).estimate, rtol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("stream: log}\nblocks", "stream: lag}\nblocks", r"input 'current' needs the stream 'lag'[\s\S]*it has: log"),
        (
            "stream: log}\nblocks",
            "stream: log, columns: [amps]}\nblocks",
            r"needs the column 'amps'[\s\S]*current, voltage",
        ),
    ],
)
def test_readings_that_are_not_there_are_named(composed: Composed, old: str, new: str, message: str) -> None:
    with pytest.raises(DataError, match=message):
        run(composed(BATTERY.replace(old, new)), logged())


def test_what_cannot_be_is_refused(composed: Composed) -> None:
    with pytest.raises(ConfigError, match=r"inputs\.current\.columns: 2 columns for 1 axes"):
        composed(BATTERY.replace("unit: A,", "unit: A, columns: [a, b],"))
    simulated = composed(f"{BATTERY}source: {{kind: simulate_model, duration: 5 s, rate: 1 Hz}}\n")
    with pytest.raises(
        ConfigError, match=r"cannot make the readings of the input 'current'\s+use a schedule, or a log"
    ):
        load_record(simulated)


def test_readings_of_an_input_that_say_when_they_arrived_are_refused(composed: Composed) -> None:
    record = logged()
    late = {name: replace(stream, arrival=stream.time + 1.0) for name, stream in record.streams.items()}
    with pytest.raises(DataError, match="reads the stream 'log', whose rows say when they arrived"):
        run_problem(composed(BATTERY), record=replace(record, streams=late))
