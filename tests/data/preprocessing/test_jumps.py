"""Impossible readings: found where they were put in, and nothing else is touched."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.data.preprocessing.jumps import JumpLimit, impossible, without_jumps
from estimfw.data.preprocessing.standstill import stuck_readings, without_stuck
from estimfw.data.record import Stream

FloatArray = NDArray[np.float64]
TIME: FloatArray = np.asarray(0.01 * np.arange(2000), dtype=float)
LIMIT = JumpLimit(rate=5.0, longest=2.0)


def drive() -> FloatArray:
    """12 m/s and gentle changes of up to 1 m/s^2."""
    return np.asarray(12.0 + 2.0 * np.sin(0.5 * TIME), dtype=float)


@given(st.lists(st.floats(-0.05, 0.05), min_size=2, max_size=200))
def test_what_changes_no_faster_than_the_limit_is_left_alone(steps: list[float]) -> None:
    x = np.asarray(np.concatenate([[3.0], 3.0 + np.cumsum(np.array(steps))]), dtype=float)
    limit = JumpLimit(rate=5.0 * (1.0 + 1e-9), longest=2.0)
    time = np.asarray(0.01 * np.arange(x.size), dtype=float)
    assert not impossible(time, x, limit, 0.01).any()


@pytest.mark.parametrize(("slip", "begin", "end"), [(2.0, 500, 600), (-1.5, 800, 830), (30.0, 3, 90)])
def test_a_slip_is_left_out_from_its_first_to_its_last_reading(slip: float, begin: int, end: int) -> None:
    x = drive()
    x[begin:end] += slip
    assert np.flatnonzero(impossible(TIME, x, LIMIT, 0.01)).tolist() == list(range(begin, end))


def test_two_slips_are_two() -> None:
    x = drive()
    x[300:350] += 2.0
    x[400:450] -= 1.0
    bad = impossible(TIME, x, LIMIT, 0.01)
    assert np.flatnonzero(bad).tolist() == [*range(300, 350), *range(400, 450)]


def test_a_lasting_change_is_believed_once_the_vehicle_can_have_made_it() -> None:
    x = drive()
    x[1000:] -= 10.0
    bad = np.flatnonzero(impossible(TIME, x, LIMIT, 0.01))
    assert bad[0] == 1000
    # 10 m/s take 2 s at 5 m/s^2, a bit more or less by what the drive itself does meanwhile.
    assert 2.0 - 0.5 < 0.01 * bad.size < 2.0 + 0.5
    assert bad.tolist() == list(range(1000, 1000 + bad.size))


def test_missing_readings_are_stepped_over() -> None:
    x = drive()
    x[400:420] = np.nan
    assert not impossible(TIME, x, LIMIT, 0.01).any()
    x[420:440] += 3.0
    assert np.flatnonzero(impossible(TIME, x, LIMIT, 0.01)).tolist() == list(range(420, 440))


def test_coarse_pulses_are_judged_by_their_means_and_a_slip_among_them_is_found() -> None:
    pulses = np.floor(np.cumsum(drive()) * 0.01 / 0.04)
    coarse = np.diff(pulses, prepend=pulses[0] - 3.0) * 0.04 / 0.01  # steps of 4 m/s
    limit = JumpLimit(rate=4.0, tolerance=0.1, window=0.3, longest=2.0)
    assert not impossible(TIME, coarse, limit, 0.01).any()
    coarse[700:800] += 4.0
    bad = np.flatnonzero(impossible(TIME, coarse, limit, 0.01))
    assert bad[0] == pytest.approx(700, abs=30)
    assert bad[-1] == pytest.approx(800, abs=30)
    assert bad[0] <= 700 <= 799 <= bad[-1]
    assert bad.tolist() == list(range(bad[0], bad[-1] + 1))


def test_columns_that_are_not_named_stay_and_the_event_counts_the_others() -> None:
    x = np.stack([drive(), drive()], axis=1)
    x[500:600] += 2.0
    raw = Stream("odometer", TIME, x, ("left", "right"), "sample", 0.01)
    made, (event,) = without_jumps(raw, ("left",), LIMIT, "m/s^2")
    assert np.isnan(made.values[:, 0]).sum() == 100
    assert np.array_equal(made.values[:, 1], x[:, 1])
    assert (event.kind, event.source, event.count) == ("jump", "odometer", 100)
    assert event.time == pytest.approx(5.0)
    assert "left changes faster than 5 m/s^2" in event.text
    assert np.isfinite(raw.values).all()


HEADING = JumpLimit(rate=20.0, tolerance=1.0, longest=2.0, period=360.0)


def heading() -> FloatArray:
    """Deg, 350 +- 60 at up to 18 deg/s: through North again and again."""
    return np.asarray((350.0 + 60.0 * np.sin(0.3 * TIME)) % 360.0, dtype=float)


def test_a_heading_that_passes_north_has_not_jumped() -> None:
    x = heading()
    assert np.max(np.abs(np.diff(x))) > 350.0
    assert not impossible(TIME, x, HEADING, 0.01).any()
    assert not impossible(TIME, np.radians(x - 180.0), JumpLimit(0.35, 0.02, 0.1, 2.0, 2.0 * np.pi), 0.01).any()


@pytest.mark.parametrize("jump", [40.0, -170.0, 179.0])
@pytest.mark.parametrize("begin", [400, 1050])
def test_a_jump_of_a_heading_is_one_on_either_side_of_north(jump: float, begin: int) -> None:
    x = heading()
    x[begin : begin + 50] = (x[begin : begin + 50] + jump) % 360.0
    bad = np.flatnonzero(impossible(TIME, x, HEADING, 0.01))
    assert bad.tolist() == list(range(begin, begin + 50))


def test_outliers_of_a_heading_one_after_the_other_are_all_found() -> None:
    x = heading()
    for k, off in zip(range(600, 640), np.random.default_rng(3).uniform(30.0, 330.0, 40), strict=True):
        x[k] = (x[k] + off) % 360.0
    bad = np.flatnonzero(impossible(TIME, x, HEADING, 0.01))
    assert bad.tolist() == list(range(600, 640))


def test_runs_side_by_side_are_as_each_alone() -> None:
    runs = np.stack([drive(), drive(), drive()])[..., None]
    runs[1, 500:600] += 2.0
    made, (event,) = without_jumps(Stream("o", TIME, runs, ("v",), "sample", 0.01), ("v",), LIMIT, "m/s^2")
    assert np.isnan(made.values).sum(axis=(1, 2)).tolist() == [0, 100, 0]
    assert event.count == 100


def test_a_stuck_sensor_is_not_used_after_its_first_reading_and_one_at_rest_is() -> None:
    x = drive()
    x[700:1400] = x[700]
    x[1500:] = 0.0
    assert np.flatnonzero(stuck_readings(TIME, x, 5.0, 0.0)).tolist() == list(range(701, 1400))
    assert not stuck_readings(TIME, x, 7.0, 0.0).any()
    assert np.flatnonzero(stuck_readings(TIME, x, 4.0, None)).tolist() == [*range(701, 1400), *range(1501, 2000)]
    made, (event,) = without_stuck(Stream("o", TIME, x[:, None], ("v",)), ("v",), 5.0, 0.0)
    assert np.isnan(made.values).sum() == event.count == 699
    assert (event.kind, event.time) == ("stuck", TIME[701])
    assert f"v shows {x[700]:.6g} without change for more than 5 s" in event.text
