"""Simulated records: ways, an INS by its exact equations, longitude, logs that are read back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_ins_errors.longitude import longitude_error_rate, trapezoid
from estimfw_ins_errors.route import Leg, voyage
from numpy.typing import NDArray

from estimfw.cli.main import main
from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.run.load import load_record

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]
Run = Callable[..., Any]
PERFECT = (
    "source.errors={attitude: 0 deg, gyro_bias: 0 deg/h, accel_bias: 0 ug, gyro_noise: 0 deg/sqrt(h), "
    "accel_noise: 0 ug/sqrt(Hz)}"
)
SEA = (
    "source.sea={surge: 0.5 m/s, yaw: 3 deg, period: 9 s}",
    "source.legs=[{time: 300 s, course: 300 deg, speed: 4 m/s}]",
)
DRIVE = "source={kind: ins_errors.simulate_drive, duration: 1200 s}"


@pytest.mark.parametrize("settings", [(), SEA, (DRIVE,)])
def test_an_ins_without_errors_records_the_way(opened: Open, settings: tuple[str, ...]) -> None:
    """Also in turns and in a seaway: Runge-Kutta and the way agree on what happens between nodes."""
    record = load_record(opened("ins_6", *settings, "source.duration=1200 s", PERFECT))
    assert record.truth is not None
    ins, true = record.streams["ins"].values, record.truth.values
    np.testing.assert_allclose(ins[:, 2:4], true["velocity_t"], rtol=0, atol=2e-7)
    np.testing.assert_allclose(ins[:, :2], np.stack([true["latitude"], true["longitude"]], axis=-1), rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.exp(1j * ins[:, 4]), np.exp(1j * true["heading"]), rtol=0, atol=1e-9)
    assert np.max(np.abs(true["attitude_error_t"])) < 1e-9


def test_a_turn_goes_the_shorter_way_round_and_takes_its_time() -> None:
    time = np.arange(0.0, 400.0, 0.5)
    route = voyage(
        time, [Leg(0.0, np.radians(350.0), 10.0), Leg(100.0, np.radians(20.0), 10.0)], np.radians(0.5), 0.02, None
    )
    assert np.degrees(route.heading[[0, 200, 320, -1]]) == pytest.approx([350.0, 350.0, 380.0, 380.0])
    speed = np.hypot(*route.velocity.T)
    np.testing.assert_allclose(speed, 10.0, atol=1e-9)


def test_a_drive_stops_and_turns(opened: Open) -> None:
    record = load_record(opened("ins_6", DRIVE))
    assert record.truth is not None
    speed = np.hypot(*record.truth.values["velocity_t"].T)
    assert np.mean(speed < 0.01) > 0.02 and speed.max() > 10.0
    assert np.ptp(np.unwrap(record.truth.values["heading"])) > np.radians(80.0)


def test_a_course_change_shows_the_azimuth_error(done: Run) -> None:
    """On a straight way gamma is not observable; turns and stops of a drive make it so, with all terms of the model."""
    complete = "process.local_level.terms=complete"
    straight = done("ins_const11", "source.duration=1200 s", complete)
    drive = done("ins_const11", DRIVE, complete)
    assert straight.sigma(1200.0)[2] > 5.9
    assert drive.sigma(1200.0)[2] < 2.0
    assert abs(drive.end_error[2]) < 4.0 * drive.sigma(1200.0)[2]


def test_longitude_error_by_the_trapezoid(opened: Open) -> None:
    """-7.2062e-3 rad after 4 h, -7.288e-3 rad without the second term: 1.1 %."""
    record = load_record(opened("ins_const11", "source.truth=linear", "source.noise=false"))
    assert record.truth is not None
    ins, true, time = record.streams["ins"].values, record.truth.values, record.truth.time
    dV, dphi = ins[:, 2] - true["velocity_t"][:, 0], ins[:, 0] - true["latitude"]
    both = trapezoid(time, longitude_error_rate(ins[:, 0], ins[:, 2], dV, dphi))
    first = trapezoid(time, longitude_error_rate(ins[:, 0], np.zeros(len(ins)), dV, dphi))
    assert both[-1] == pytest.approx(-7.2062e-3, abs=5e-8)
    assert first[-1] == pytest.approx(-7.2880e-3, abs=1e-7)
    np.testing.assert_allclose(ins[:, 1] - true["longitude"], both, rtol=0, atol=1e-12)


def test_longitude_as_a_state_is_the_trapezoid(opened: Open) -> None:
    block = "blocks.longitude_error={kind: ins_errors.longitude_error, sigma: 0.01 arcmin}"
    record = load_record(opened("ins_const11", "source.truth=linear", "source.noise=false", block))
    assert record.truth is not None
    found = record.streams["ins"].values[-1, 1] - record.truth.values["longitude"][-1]
    assert found == pytest.approx(-7.2062e-3, abs=1e-7)


def test_outages_leave_rows_out(opened: Open) -> None:
    record = load_record(
        opened("ins_6", "source.duration=600 s", "source.references={velocity: {outages: [[100 s, 200 s]]}}")
    )
    time = record.streams["velocity"].time
    assert time.size == 50
    assert not np.any((time >= 100.0) & (time < 200.0))


def test_references_come_at_their_own_rates(done: Run) -> None:
    found = done("ins_const11_heading", "source.duration=600 s", "source.references={heading: {every: 60 s}}").run
    assert np.count_nonzero(found.disposition[:, 1] == 0) == 10
    assert np.count_nonzero(found.disposition[:, 0] == 0) == 60


def test_an_error_for_a_state_that_is_not_there_is_refused(opened: Open) -> None:
    problem = opened("ins_6", "source.truth=linear", "source.errors.gyro_bias=0.1 deg/h")
    with pytest.raises(ConfigError, match="no block is called 'gyro_bias'"):
        load_record(problem)


def test_a_simulation_needs_a_place(opened: Open) -> None:
    with pytest.raises(ConfigError, match="place to start from"):
        opened("ins_6", "site=null")


def test_written_logs_are_read_back_to_the_same_estimates(opened: Open, done: Run, tmp_path: Path) -> None:
    """`estimfw simulate` writes, `source: log` reads: units by column, names of columns by config."""
    example = Path(__file__).parents[3] / "examples" / "ins_const11_heading.yaml"
    folder = tmp_path / "logs"
    arguments = ["simulate", str(example), "--set", "source.duration=600 s", "--format", "csv", "--output", str(folder)]
    assert main(arguments) == 0
    lines = (folder / "ins.csv").read_text(encoding="utf-8").splitlines()
    names = {"latitude": "lat", "longitude": "lon", "heading": "hdg"}
    rows = np.array([[float(x) for x in line.split(",")] for line in lines[1:]])
    rows[:, [1, 2, 5]] = np.degrees(rows[:, [1, 2, 5]])
    header = ",".join(names.get(name, name) for name in lines[0].split(","))
    in_degrees = [",".join(repr(x) for x in row) for row in rows.tolist()]
    (folder / "ins.csv").write_text("\n".join([header, *in_degrees]) + "\n", encoding="utf-8")
    streams = (
        f"ins: {{file: {folder}/ins.csv, units: {{lat: deg, lon: deg, hdg: deg}}}}, velocity: {{file: {folder}/velocity.csv}}, "
        f"heading: {{file: {folder}/heading.csv}}"
    )
    read = done(
        "ins_const11_heading", f"source={{kind: log, streams: {{{streams}}}}}",
        "nominal.columns={latitude: lat, longitude: lon, heading: hdg}",
    )  # fmt: skip
    made = done("ins_const11_heading", "source.duration=600 s")
    np.testing.assert_allclose(read.run.estimate, made.run.estimate, rtol=0, atol=1e-9)
    np.testing.assert_allclose(read.run.output, made.run.output, rtol=0, atol=1e-9)
