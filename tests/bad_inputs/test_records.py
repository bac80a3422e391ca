"""Logs that can be read but not trusted (36, 37, 40 to 42, 47): exit code 5 with a guess, or a flag."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

Check = Callable[..., Any]


def test_36_time_that_goes_backwards_is_refused_sorted_or_dropped(fix_check: Check, fixes: str) -> None:
    late = fixes.replace("5.0,10.5,20.5", "4.25,10.5,20.5")
    told = fix_check(late)
    assert told.code == 5
    told.says("fix.csv:11: time goes backwards, from 4.5 s to 4.25 s\n  11 | 4.25,10.5,20.5")
    told.says("`time_errors: sort`", "`time_errors: drop`")
    told = fix_check(late, "time_errors=sort")
    assert told.code == 0
    told.says("20 steps", "note: fix: time order, time goes backwards, from 4.5 s to 4.25 s; 1 late row sorted")
    told = fix_check(late, "time_errors=drop")
    assert told.code == 0
    told.says("19 steps", "1 late row dropped")


def test_36_an_imu_whose_time_goes_backwards_is_refused(imu_check: Check, imu: Any) -> None:
    told = imu_check(imu.changed((100, 0), lambda t: t - 1.0).csv())
    assert told.code == 5
    told.says("log.csv:102: time goes backwards, from 10 s to 9.1 s")


def test_37_identical_rows_of_one_time_are_dropped_and_flagged(fix_check: Check, fixes: str) -> None:
    row = "5.0,10.5,20.5\n"
    told = fix_check(fixes.replace(row, row + row), command="run")
    assert told.code == 0
    done = json.loads(told.out)
    assert done["dispositions"]["fused"] == 20
    (event,) = [e for e in done["events"] if e["kind"] == "duplicate"]
    assert (event["source"], event["time"], event["count"]) == ("fix", 5.0, 1)


def test_37_different_rows_of_one_time_are_refused(fix_check: Check, imu_check: Check, fixes: str, imu: Any) -> None:
    told = fix_check(fixes.replace("5.0,10.5,20.5", "4.5,10.5,20.5"))
    assert told.code == 5
    told.says("fix.csv:11: two different rows have the time stamp 4.5 s")
    told = imu_check(imu.changed((100, 0), lambda t: t - 0.1).csv())
    assert told.code == 5
    told.says("log.csv:102: two different rows have the time stamp 10 s")


def test_40_milliseconds_for_seconds_are_guessed_from_the_rate(
    imu_check: Check, fix_check: Check, imu: Any, fixes: str
) -> None:
    thousandfold = imu.changed((slice(None), 0), lambda t: 1000.0 * t).csv()
    told = imu_check(thousandfold)
    assert told.code == 5
    told.says("log.csv: the time stamps are 100 s apart: time in ms, not in s?", "`units: {time: ms}`")
    told = imu_check(thousandfold, "source.rate=10 Hz")
    assert told.code == 5
    told.says("the time stamps are 100 s apart, the sampling interval is 0.1 s: time in ms, not in s?")
    assert imu_check(thousandfold, "source.units={time: ms}").code == 0
    told = fix_check(fixes, "rate=2000 Hz")
    assert told.code == 5
    told.says("fix.csv: the time stamps are 0.5 s apart, the sampling interval is 0.0005 s: time in ms, not in s?")
    assert fix_check(fixes, "rate=2 Hz").code == 0


@pytest.mark.parametrize(
    ("columns", "factor", "parts"),
    [
        (slice(1, 4), 180.0 / np.pi, ("the mean rate is", "deg for rad?", "say `units: {gyro: deg}`")),
        (
            slice(4, 7),
            1.0 / 9.80665,
            ("the mean specific force is", "g for m/s^2?", "say `units: {accel: g*s}`"),
        ),
        (slice(1, 7), 10.0, ("rates taken for increments?", "say `values: rate`")),
    ],
    ids=["41-deg-for-rad", "41-g-for-m/s^2", "41-rate-for-increment"],
)
def test_41_wrong_units_of_a_standing_imu_are_guessed(
    imu_check: Check, imu: Any, columns: slice, factor: float, parts: tuple[str, ...]
) -> None:
    told = imu_check(imu.changed((slice(None), columns), lambda x: factor * x).csv())
    assert told.code == 5
    told.says("log.csv: ", *parts)


@pytest.mark.parametrize(
    ("order", "signs", "parts"),
    [
        ([1, 3, 2, 4, 6, 5], [1, 1, 1, 1, 1, 1], ("shows on +y, not on +z: axes swapped?", "source.mounting")),
        ([1, 2, 3, 4, 5, 6], [1, 1, 1, -1, -1, -1], ("the signs of the accelerometers are flipped",)),
        ([1, 2, 3, 4, 5, 6], [1, -1, -1, 1, -1, -1], ("shows on -z, not on +z: z points down?", "source.mounting")),
    ],
    ids=["42-swapped", "42-flipped", "42-z-down"],
)
def test_42_swapped_axes_and_flipped_signs_show_in_the_direction_of_gravity(
    imu_check: Check, imu: Any, order: list[int], signs: list[int], parts: tuple[str, ...]
) -> None:
    told = imu_check(imu.changed((slice(None), slice(1, 7)), lambda x: x[:, np.array(order) - 1] * signs).csv())
    assert told.code == 5
    told.says("log.csv: the reaction to gravity ", *parts)


@pytest.fixture
def departing(imu: Any) -> str:
    """The vehicle stands for 15 s, then drives off to the right."""
    log: str = imu.changed((slice(150, None), 4), lambda x: x + 0.1).csv()
    return log


def test_47_a_vehicle_that_drives_off_is_flagged_and_the_run_stopped_or_restarted(
    imu_check: Check, imu: Any, departing: str
) -> None:
    assert not [e for e in json.loads(imu_check(imu.csv(), command="run").out)["events"] if e["kind"] == "motion"]
    flagged = json.loads(imu_check(departing, command="run").out)
    (event,) = [e for e in flagged["events"] if e["kind"] == "motion"]
    assert event["source"] == "motion"
    assert event["time"] == pytest.approx(15.0, abs=1.0)
    assert "the vehicle accelerates from 15.0 to 20.0 s" in event["text"]
    assert flagged["time"] == pytest.approx(20.0)
    stopped = json.loads(imu_check(departing, "monitors.motion.action=stop", command="run").out)
    assert stopped["time"] == pytest.approx(15.0, abs=1.0)
    assert abs(stopped["states"]["velocity_error[N]"]["value"]) < 0.05


def test_47_a_vehicle_that_moves_from_the_start_leaves_nothing_to_run(imu_check: Check, imu: Any) -> None:
    turning = imu.changed((slice(None), 3), lambda x: x + np.radians(2.0) * 0.1)
    told = imu_check(turning.csv(), "source.checks=false", "monitors.motion.action=stop", command="run")
    assert told.code == 5
    told.says("the run would stop before its first step", "the vehicle moves from the start")
