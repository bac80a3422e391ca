"""A session on raw rows gives the estimates of a batch run on the whole record, later by the latency that it tells."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import UsageError
from estimfw.model.nominal import InitialNominal
from estimfw.run.load import source_record
from estimfw.run.preprocess import preprocessed
from estimfw.run.preprocessing_session import PreprocessingSession
from estimfw.run.run import Collected, run_problem
from estimfw.run.session import Estimate

Composed = Callable[[str], Problem]
FloatArray = NDArray[np.float64]

DRIVEN = """\
estimfw: 1
site: {latitude: 34 deg, longitude: 75 deg, height: 0 m}
nominal: {kind: inertial.strapdown, samples: 2}
initial_attitude: {yaw: 22 deg, pitch: 1 deg, roll: -1 deg}
blocks:
  velocity_error: {kind: sins_static.velocity_error, sigma: 0.1 m/s}
  attitude_error: {kind: sins_static.attitude_error, sigma: [0.5 deg, 0.5 deg, 5 deg]}
process:
  phi_angle: {kind: sins_static.phi_angle, gyro_noise: 0.001 deg/sqrt(h), accel_noise: 10 ug/sqrt(Hz)}
measurements:
  odometer: {kind: direct, of: [{block: velocity_error, axes: [E]}], noise: 1 m/s, stream: STREAM, columns: [speed]}
estimator: {kind: kalman, loop: closed}
source: {kind: sins_static.simulate, duration: 12 s, rate: 20 Hz, misalignment: [0.1 deg, 0.1 deg, 0.1 deg]}
preprocess:
  clock: {kind: shift, stream: wheel, latency: 0.07 s}
  pulses: {kind: counter, stream: wheel, columns: {n: speed}, scale: 0.001 m, modulus: 65536, fastest: 70 m/s}
  smooth: {kind: fir_lowpass, stream: wheel, cutoff: 1 Hz, length: 2 s, longest_gap: 0.3 s}
"""
ONTO = "  onto: {kind: join, stream: wheel, onto: imu, columns: {speed: speed}}\n"
DRIVER = DRIVEN.replace("STREAM", "imu") + ONTO
BESIDE = DRIVEN.replace("STREAM", "wheel")


def with_wheel(record: Record) -> Record:
    """An odometer beside the IMU: 10 Hz, late, with a counter that wraps and counts that are missing."""
    time = np.asarray(0.1 * np.arange(0, 121), dtype=float)
    distance = 2.0 * time + np.sin(0.8 * time)
    counts = (65000.0 + np.floor(distance / 0.001)) % 65536.0
    counts[[40, 41]] = np.nan
    wheel = Stream("wheel", time + 0.07, np.asarray(counts, dtype=float)[:, None], ("n",), "sample", 0.1)
    return Record({**record.streams, "wheel": wheel}, record.truth, initial=record.initial)


def streamed(problem: Problem, record: Record) -> tuple[PreprocessingSession, list[Estimate], list[float]]:
    """All rows by their stamps; the estimates, and how late each came."""
    start = InitialNominal({"C_bn": record.initial["C_bn"]}) if "C_bn" in record.initial else None
    session = PreprocessingSession(problem, record.streams, start)
    rows = [
        (float(t), s.name == problem.provider.stream, s.name, s.values[k])
        for s in record.streams.values()
        for k, t in enumerate(s.time)
    ]
    done, late = [], []
    for time, _, name, values in sorted(rows, key=lambda row: row[:2]):
        made = session.feed(name, time, values)
        done += made
        late += [time - e.time for e in made]
    return session, done + session.finish(), late


def agree(done: list[Estimate], batch: Collected) -> None:
    """At the instants of the session; a batch run may end a few steps later or earlier."""
    time = batch.prepared.steps.time
    at = [int(np.argmin(np.abs(time - e.time))) for e in done if e.time <= time[-1] + 1e-9]
    assert len(at) > 0.9 * time.size
    assert [e.time for e in done[: len(at)]] == pytest.approx(time[at])
    states = np.array([[value for value, _ in e.states.values()] for e in done[: len(at)]])
    sigmas = np.array([[sigma for _, sigma in e.states.values()] for e in done[: len(at)]])
    assert states == pytest.approx(batch.estimate[at], rel=1e-9, abs=1e-12)
    assert sigmas == pytest.approx(batch.sigma[at], rel=1e-9)


@pytest.mark.parametrize("config", [DRIVER, BESIDE], ids=["joined onto the IMU", "beside the IMU"])
def test_an_odometer_with_all_its_filters_equals_the_batch_run(composed: Composed, config: str) -> None:
    problem = composed(config)
    record = with_wheel(source_record(problem))
    batch = run_problem(problem, record=preprocessed(problem, record))
    session, done, late = streamed(problem, record)
    agree(done, batch)
    assert {"wrap", "missing", "bridged"} <= {event.kind for event in session.events}
    assert "late" not in {event.kind for event in session.events}
    fused = session.session
    assert fused is not None
    assert fused.counts["odometer"]["fused"] > 20
    # Half of the window, and what gaps and the shift can cost; a step is done when its last row is through.
    assert max(late) <= session.latency + 0.1
    assert session.latency < 1.0 + 0.3 + 0.07 + 3 * 0.1 + 1e-9


TRACKER = """\
estimfw: 1
blocks:
  position: {kind: random_constant, unit: m, sigma: 100 m}
  velocity: {kind: random_walk, unit: m/s, sigma: 20 m/s, noise: 0.1 m/s/sqrt(s)}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}], noise: 1 m, columns: [x]}
  speed: {kind: direct, of: [{block: velocity}], noise: 0.2 m/s, columns: [v]}
preprocess:
  smooth: {kind: fir_lowpass, stream: speed, columns: [v], cutoff: 0.5 Hz, length: 4 s}
"""


def test_a_model_without_a_driving_stream_goes_on_as_its_measurements_get_through(composed: Composed) -> None:
    problem, rng = composed(TRACKER), np.random.default_rng(2)
    time, seconds = np.asarray(0.1 * np.arange(1, 301), dtype=float), np.arange(1.0, 31.0)
    speed = Stream("speed", time, 5.0 + 0.2 * rng.standard_normal((300, 1)), ("v",), "sample", 0.1)
    fix = Stream("fix", seconds, 5.0 * seconds[:, None] + rng.standard_normal((30, 1)), ("x",), "sample", 1.0)
    record = Record({"speed": speed, "fix": fix})
    session, done, _ = streamed(problem, record)
    batch = run_problem(problem, record=preprocessed(problem, record))
    assert done[-1].time == pytest.approx(30.0) == batch.prepared.steps.time[-1]
    value, sigma = done[-1].states["velocity"]
    assert value == pytest.approx(batch.estimate[-1, 1], rel=1e-9)
    assert sigma == pytest.approx(batch.sigma[-1, 1], rel=1e-9)
    assert session.latency == pytest.approx(2.05)
    assert "late" not in {event.kind for event in session.events}


def test_a_component_that_looks_ahead_is_refused_by_name(composed: Composed) -> None:
    slip = "  slip: {kind: jump_limit, stream: speed, columns: [v], rate: 5 m/s^2}\n"
    speed = Stream("speed", np.zeros(0), np.zeros((0, 1)), ("v",), "sample", 0.1)
    with pytest.raises(UsageError, match="preprocess 'slip' needs the whole record: a session cannot have it"):
        PreprocessingSession(composed(TRACKER + slip), {"speed": speed})


def test_streams_and_values_that_nobody_told_of_are_refused(composed: Composed) -> None:
    speed = Stream("speed", np.zeros(0), np.zeros((0, 1)), ("v",), "sample", 0.1)
    session = PreprocessingSession(composed(TRACKER), {"speed": speed})
    with pytest.raises(UsageError, match="no stream 'sped'"):
        session.feed("sped", 0.0, [1.0])
    with pytest.raises(UsageError, match="says no period"):
        PreprocessingSession(composed(TRACKER), {"speed": Stream("speed", np.zeros(0), np.zeros((0, 1)), ("v",))})
