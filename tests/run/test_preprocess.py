"""Preprocessing in a config: what the filter sees is what the components make, on every way to it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import estimfw
from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError, DataError, UsageError
from estimfw.montecarlo.draw import draw_runs, drawn_record
from estimfw.run.load import load_record, source_record
from estimfw.run.preprocess import preprocessed
from estimfw.run.session import Session

Composed = Callable[[str], Problem]

MODEL = """\
estimfw: 1
blocks:
  position: {kind: random_constant, unit: m, sigma: 100 m}
  velocity: {kind: random_walk, unit: m/s, sigma: 20 m/s, noise: 0.1 m/s/sqrt(s)}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}], noise: 1 m, columns: [x]}
  speed: {kind: direct, of: [{block: velocity}], noise: 0.2 m/s, stream: STREAM, columns: [speed]}
"""
PULSES = (
    "pulses: {kind: counter, stream: odometer, columns: {n: speed}, scale: 0.04 m, modulus: 65536, fastest: 70 m/s}"
)
SMOOTH = "smooth: {kind: fir_lowpass, stream: odometer, columns: [speed], cutoff: 0.5 Hz, length: 4 s}"
ONTO = "onto: {kind: join, stream: odometer, onto: fix, columns: {speed: speed}}"


def logged(*steps: str, stream: str = "fix") -> str:
    source = "source: {kind: log, streams: {fix: {file: fix.csv}, odometer: {file: odometer.csv, rate: 100 Hz}}}\n"
    return MODEL.replace("STREAM", stream) + source + "preprocess:\n" + "".join(f"  {step}\n" for step in steps)


@pytest.fixture(autouse=True)
def logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A drive at 10 m/s: fixes at 1 Hz and pulses at 100 Hz, whose counter wraps."""
    monkeypatch.chdir(tmp_path)
    seconds = range(1, 21)
    (tmp_path / "fix.csv").write_text("time,x\n" + "".join(f"{k},{10.0 * k}\n" for k in seconds))
    counts = (65000 + 250 * np.arange(0, 2001) // 100) % 65536
    rows = "".join(f"{k / 100},{n}\n" for k, n in enumerate(counts))
    (tmp_path / "odometer.csv").write_text("time,n\n" + rows)


def test_counts_become_a_filtered_speed_on_the_stamps_of_the_fixes(composed: Composed) -> None:
    problem = composed(logged(PULSES, SMOOTH, ONTO))
    raw, record = source_record(problem), load_record(problem)
    assert raw.streams["odometer"].columns == ("n",)
    assert record.streams["fix"].columns == ("x", "speed")
    assert record.streams["fix"].time.tolist() == list(range(2, 19))
    assert record.streams["fix"].values[:, 1] == pytest.approx(np.full(17, 10.0), abs=0.01)
    done = estimfw.run_filter(problem)
    assert float(done["estimate"][-1, 1]) == pytest.approx(10.0, abs=0.01)
    assert estimfw.run_filter(problem, raw).equals(done)


def test_components_act_in_the_order_of_the_config(composed: Composed) -> None:
    raw = source_record(composed(logged(PULSES, SMOOTH, ONTO)))
    with pytest.raises(DataError, match="preprocess 'smooth': stream 'odometer' has no column 'speed'") as told:
        preprocessed(composed(logged(SMOOTH, PULSES, ONTO)), raw)
    assert told.value.location is not None
    assert (told.value.location.line, told.value.location.column) == (12, 11)


@pytest.mark.parametrize(
    ("step", "line", "says"),
    [
        (PULSES.replace("65536, fastest: 70 m/s", "65536"), 12, "a counter that wraps needs `fastest`"),
        (PULSES.replace("70 m/s", "70 deg/s"), 12, "`fastest` is in rad/s, `scale` in m"),
        (PULSES.replace("0.04 m,", "0.04,"), 12, "`fastest` is in m/s, `scale` in 1"),
        (PULSES.replace("0.04 m,", "0.1 deg,").replace("70 m/s", "70 deg/s"), 12, "is in rad/s here, and is read in m/s"),
        (PULSES.replace("rate", "count").replace("0.04 m", "-0.04"), 12, "`fastest` is in m/s, `scale` in 1"),
        (PULSES.replace("kind: counter", "kind: count"), 12, "unknown preprocess kind 'count'"),
        (SMOOTH.replace(", length: 4 s", ""), 12, "give `length` or `taps`, one of them"),
        (SMOOTH.replace("0.5 Hz", "0.5 s"), 12, "'0.5 s' is in s, not in Hz"),
        (ONTO.replace("{speed: speed}", "{}"), 12, "preprocess.onto.columns"),
        ("clock: {kind: shift, stream: odometer, latency: 50}", 12, "50 has no unit"),
    ],
)  # fmt: skip
def test_a_wrong_setting_is_refused_at_its_place_before_any_data_is_read(
    composed: Composed, step: str, line: int, says: str
) -> None:
    Path("odometer.csv").unlink()
    with pytest.raises(ConfigError) as told:
        composed(logged(step, stream="odometer"))
    assert says in str(told.value)
    assert told.value.location is not None
    assert told.value.location.line == line


SIMULATED = MODEL.replace("STREAM", "speed") + (
    "source: {kind: simulate_model, duration: 30 s, rate: 1 Hz, rates: {speed: 10 Hz}}\n"
    "preprocess: {smooth: {kind: fir_lowpass, stream: speed, cutoff: 0.5 Hz, length: 4 s}}\n"
)


def test_every_run_of_a_monte_carlo_is_preprocessed_as_if_it_were_alone(composed: Composed) -> None:
    problem = composed(SIMULATED)
    three, third = draw_runs(problem, 7, range(3)), drawn_record(problem, 7, 2)
    assert three.record.streams["speed"].values.shape == (3, 260, 1)
    assert np.array_equal(three.run(2).streams["speed"].values, third.streams["speed"].values)
    raw = draw_runs(composed(SIMULATED.partition("preprocess")[0]), 7, range(3))
    assert raw.record.streams["speed"].values.shape == (3, 300, 1)
    smooth = three.record.streams["speed"].values.std(axis=1)
    assert np.all(smooth < raw.record.streams["speed"].values.std(axis=1))


def test_a_record_from_python_is_preprocessed_too(composed: Composed) -> None:
    problem = composed(logged(PULSES, SMOOTH, ONTO))
    time = np.arange(0.0, 20.0, 0.01)
    pulses = Stream("odometer", time, np.floor(125.0 * time)[:, None], ("n",), "sample", 0.01)
    fix = Stream("fix", np.arange(1.0, 20.0), 5.0 * np.arange(1.0, 20.0)[:, None], ("x",))
    done = estimfw.run_filter(problem, Record({"odometer": pulses, "fix": fix}))
    assert float(done["estimate"][-1, 1]) == pytest.approx(5.0, abs=0.01)


def test_a_session_says_that_it_cannot_preprocess(composed: Composed) -> None:
    with pytest.raises(UsageError, match="a session does not preprocess: clock, smooth"):
        Session(composed(logged("clock: {kind: shift, stream: odometer}", SMOOTH, stream="odometer")))
