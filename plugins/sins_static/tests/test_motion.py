"""A vehicle that moves during static alignment is flagged; the run stops before it or begins anew after it, as asked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimfw_sins_static.motion import MotionConfig, MotionMonitor
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.data.record import Record
from estimfw.errors import DataError
from estimfw.run.answer import answer
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]

FAST = "estimator.kernel=numba"


EARTH_RATE_N = 7.292115e-5 * np.array([0.0, np.cos(np.radians(34.0)), np.sin(np.radians(34.0))])


def changed(record: Record, start: float, stop: float, rate: float = 0.0, acceleration: float = 0.0) -> Record:
    """The record (level, yaw 0) with a turn about Up (deg/s) and an acceleration along y (m/s^2) between two instants."""
    imu = record.streams["imu"]
    moving = (imu.time > start) & (imu.time <= stop)
    values = imu.values.copy()
    period = float(imu.period or 0.0)
    turn = np.where(moving, np.radians(rate) * period, 0.0)
    yaw = np.cumsum(turn)
    middle = Rotation.from_rotvec((yaw - 0.5 * turn)[:, None] * np.array([0.0, 0.0, 1.0]))
    values[:, :3] += (middle.inv().apply(EARTH_RATE_N) - EARTH_RATE_N) * period
    values[:, 2] += turn
    values[moving, 4] += acceleration * period
    assert record.truth is not None
    C_bn = Rotation.from_rotvec(yaw[:, None] * np.array([0.0, 0.0, 1.0])).as_matrix()
    truth = replace(record.truth, values={**record.truth.values, "C_bn": C_bn})
    return replace(record, streams={**record.streams, "imu": replace(imu, values=values)}, truth=truth)


def watched(composed: Callable[..., Any], action: str, *overrides: str) -> Any:
    return composed("static_7", f"monitors={{base: {{kind: sins_static.motion, action: {action}}}}}", FAST, *overrides)


def test_vehicle_that_turns_is_flagged_with_time_and_length(composed: Callable[..., Any]) -> None:
    problem = watched(composed, "flag")
    done = run_problem(problem, record=changed(problem.source.load(), 300.0, 320.0, rate=5.0))
    (event,) = done.events
    assert (event.source, event.kind, event.time, event.count) == ("base", "motion", 300.0, 20)
    assert event.text == "the vehicle turns from 300.0 to 320.0 s: not a static base"
    assert done.prepared.steps.time[-1] == pytest.approx(600.0)  # flagged, no more


def test_vehicle_that_drives_off_is_flagged_and_the_answer_says_so(composed: Callable[..., Any]) -> None:
    problem = watched(composed, "flag")
    done = run_problem(problem, record=changed(problem.source.load(), 500.0, 510.0, acceleration=0.5))
    (found,) = answer(result_dataset(done))["events"]
    assert (found["kind"], found["time"], found["count"]) == ("motion", 500.0, 10)
    assert found["text"] == "the vehicle accelerates from 500.0 to 510.0 s: not a static base"


def test_run_stops_before_the_motion(composed: Callable[..., Any]) -> None:
    problem = watched(composed, "stop")
    record = problem.source.load()
    done = run_problem(problem, record=changed(record, 300.0, 320.0, rate=5.0, acceleration=1.0))
    assert done.prepared.steps.time[-1] == pytest.approx(300.0)
    still = run_problem(problem, record=record)
    np.testing.assert_array_equal(done.estimate, still.estimate[:300])
    assert "turns and accelerates" in done.events[0].text


@pytest.mark.parametrize(
    ("start", "stop", "duration"), [(2.0, 9.0, 30), (0.0, 8.0, 20), (1.0, 5.0, 12), (3.0, 7.0, 13)]
)
def test_motion_within_the_first_seconds_is_told_from_the_rest_of_a_short_record(
    start: float, stop: float, duration: int, composed: Callable[..., Any]
) -> None:
    record = composed("static_7", f"source.duration={duration} s", "source.rate=10 Hz").source.load()
    (event,) = (
        MotionMonitor("base", MotionConfig(kind="sins_static.motion"))
        .inspect(changed(record, start, stop, acceleration=0.5))
        .events
    )
    assert event.time == pytest.approx(start)
    assert event.count == int(stop - start)


def test_vehicle_that_parks_on_a_slope_is_at_rest_where_it_stood_first(composed: Callable[..., Any]) -> None:
    record = composed("static_7", "source.duration=100 s", "source.rate=10 Hz").source.load()
    (event,) = (
        MotionMonitor("base", MotionConfig(kind="sins_static.motion"))
        .inspect(changed(record, 15.0, 100.0, acceleration=0.5))
        .events
    )
    assert event.time == pytest.approx(15.0)
    assert event.count == 85


def test_motion_from_the_first_second_leaves_nothing_to_run(composed: Callable[..., Any]) -> None:
    problem = watched(composed, "stop")
    with pytest.raises(DataError, match="stop before its first step") as caught:
        run_problem(problem, record=changed(problem.source.load(), 0.0, 5.0, rate=5.0))
    assert caught.value.exit_code == 5


def test_alignment_begins_anew_after_the_motion_and_finds_the_new_heading(composed: Callable[..., Any]) -> None:
    problem = watched(composed, "restart", "source.noise=false")
    done = run_problem(problem, record=changed(problem.source.load(), 200.0, 218.0, rate=5.0))
    assert done.prepared.steps.time[done.prepared.steps.restart] == pytest.approx([219.0])  # the first step after 218 s
    assert done.output_truth is not None and done.output_error is not None
    assert np.degrees(done.output_truth[-1, 0]) == pytest.approx(90.0, abs=1e-6)
    # At a yaw of 90 deg the y gyro looks west: eps_E = -0.01 deg/h, a_E = -100 ug, and the limit is -0.0421 + 0.0006 deg.
    assert abs(np.degrees(done.output_error[-1, 0]) + 0.0415) < 0.005
    assert np.all(np.abs(np.degrees(done.output_error[-1, 1:3])) < 0.008)


@pytest.mark.parametrize(
    ("sway", "flagged"),
    [
        ("{amplitude: [0.1 deg, 0.1 deg, 0.1 deg], period: 8 s}", False),  # wind and people
        ("{amplitude: [0 deg, 0 deg, 5 deg], period: 20 s}", True),  # 1.6 deg/s
    ],
)
def test_swaying_base_stands_until_it_turns_faster_than_the_limit(
    sway: str, flagged: bool, composed: Callable[..., Any]
) -> None:
    done = run_problem(watched(composed, "flag", f"source.sway={sway}", "source.rate=10 Hz", "source.duration=60 s"))
    assert bool(done.events) == flagged


def test_limits_are_settings(composed: Callable[..., Any]) -> None:
    record = changed(composed("static_7").source.load(), 300.0, 320.0, rate=0.2)
    still = MotionMonitor("base", MotionConfig(kind="sins_static.motion"))
    strict = MotionMonitor("base", MotionConfig.model_validate({"kind": "sins_static.motion", "rate": "0.1 deg/s"}))
    assert still.inspect(record).events == ()
    assert len(strict.inspect(record).events) == 1


def test_vibration_is_averaged_out(composed: Callable[..., Any]) -> None:
    problem = composed("static_7", "source.rate=100 Hz", "source.duration=20 s")
    record = problem.source.load()
    imu = record.streams["imu"]
    shaken = imu.values.copy()
    shaken[:, 3] += 5.0 * np.sin(2.0 * np.pi * 20.0 * imu.time) / 100.0  # 5 m/s^2 at 20 Hz
    record = replace(record, streams={"imu": replace(imu, values=shaken)})
    assert MotionMonitor("base", MotionConfig(kind="sins_static.motion")).inspect(record).events == ()


def test_missing_rows_are_no_motion(composed: Callable[..., Any]) -> None:
    record = composed("static_7", "source.rate=10 Hz", "source.duration=30 s").source.load()
    imu = record.streams["imu"]
    holes = imu.values.copy()
    holes[100:125] = np.nan  # two whole windows and a half
    record = replace(record, streams={"imu": replace(imu, values=holes)})
    assert MotionMonitor("base", MotionConfig(kind="sins_static.motion")).inspect(record).events == ()


def test_record_without_an_imu_is_refused_naming_its_streams() -> None:
    monitor = MotionMonitor("base", MotionConfig(kind="sins_static.motion"))
    with pytest.raises(DataError, match="monitor 'base' needs the stream 'imu'"):
        monitor.inspect(Record(streams={}))
