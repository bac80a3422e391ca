"""Streams at their own rates become steps; what is wrong with their rows is decided and said here."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from estimfw.data.record import Stream
from estimfw.data.timeline import Steps, Wanted, driven_steps, merged_steps
from estimfw.errors import DataError


def stream(name: str, time: ArrayLike, values: ArrayLike | None = None, period: float | None = None) -> Stream:
    t = np.asarray(time, dtype=float)
    v = np.arange(t.size, dtype=float)[:, None] if values is None else np.asarray(values, dtype=float)
    return Stream(name, t, v, ("z",), "sample", period)


def driving(time: ArrayLike, period: float) -> Stream:
    t = np.asarray(time, dtype=float)
    return Stream("imu", t, np.zeros((t.size, 1)), ("z",), "increment", period)


def merged(*streams: Stream, **options: Any) -> Steps:
    return merged_steps({s.name: s for s in streams}, [Wanted(s.name, s.name) for s in streams], **options)


def kinds(steps: Steps) -> list[tuple[str, str, int]]:
    return [(e.source, e.kind, e.count) for e in steps.events]


def test_streams_at_their_own_rates_are_merged() -> None:
    steps = merged(stream("a", [0.5, 1.0, 1.5, 2.0]), stream("b", [0.2, 0.4, 0.6, 0.8, 1.0, 1.2]), start=0.0)
    np.testing.assert_allclose(steps.time, [0.2, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0])
    np.testing.assert_allclose(np.cumsum(steps.dt), steps.time)
    np.testing.assert_array_equal(steps.due["a"].row, [-1, -1, 0, -1, -1, 1, -1, 2, 3])
    np.testing.assert_array_equal(steps.due["b"].row, [0, 1, -1, 2, 3, 4, 5, -1, -1])
    np.testing.assert_allclose(steps.due["a"].interval, 0.5)
    np.testing.assert_allclose(steps.due["b"].interval, 0.2)


def test_instants_that_differ_by_rounding_are_one() -> None:
    steps = merged(stream("a", [0.1 * 3, 0.6]), stream("b", [0.3, 0.1 * 6]), start=0.0)
    assert len(steps) == 2
    np.testing.assert_array_equal(steps.due["a"].row, [0, 1])
    np.testing.assert_array_equal(steps.due["b"].row, [0, 1])


def test_equal_steps_are_equal_to_the_last_bit() -> None:
    time = 1e5 + 0.1 * np.arange(1, 1001)
    assert np.unique(np.diff(time)).size > 1
    assert np.unique(merged(stream("a", time), start=1e5).dt).size == 1
    driver = driving(time, 0.1)
    np.testing.assert_array_equal(driven_steps(driver, 2, {}, []).dt, 0.2)


def test_the_start_is_zero_where_it_is_zero_but_for_rounding() -> None:
    time = np.arange(1, 1001) / 300.0
    period = float(np.median(np.diff(time)))
    assert time[0] != period
    assert driven_steps(driving(time, period), 3, {}, []).start == 0.0
    assert driven_steps(driving(0.01 + time, 1 / 300.0), 3, {}, []).start == pytest.approx(0.01)


def test_the_first_step_begins_at_the_start_to_the_last_bit() -> None:
    every = np.arange(1, 301) / 5.0
    steps = merged(stream("a", every), stream("b", np.arange(1, 121) / 2.0), start=0.0)
    assert steps.time[0] - steps.dt[0] != 0.0, "equal steps are equal to the last bit, instants are not"
    assert steps.begin[0] == 0.0
    np.testing.assert_array_equal(steps.begin[1:], (steps.time - steps.dt)[1:])


def test_without_a_start_the_first_row_is_it() -> None:
    steps = merged(stream("a", [3.0, 4.0]))
    assert steps.start == 3.0
    np.testing.assert_array_equal(steps.dt, [0.0, 1.0])


def test_a_run_ends_with_its_data_not_with_its_schedule() -> None:
    steps = merged(stream("a", [1.0, 2.0, 3.0]), start=0.0, instants=[-1.0, 0.0, 0.5, 99.0], restarts=[2.5, 50.0])
    np.testing.assert_array_equal(steps.time, [0.5, 1.0, 2.0, 2.5, 3.0])
    np.testing.assert_array_equal(steps.restart, [False, False, False, False, True])


def test_a_restart_holds_for_the_step_that_begins_then_or_next() -> None:
    driver = driving(np.arange(1.0, 11.0), 1.0)
    steps = driven_steps(driver, 1, {}, [], restarts=[0.0, 4.0, 6.5, 100.0])
    assert list(steps.time[steps.restart] - 1.0) == [4.0, 7.0]


def test_a_gap_is_said_and_the_filter_coasts_over_it() -> None:
    steps = merged(stream("a", [1, 2, 3, 6, 7, 9], period=1.0), start=0.0)
    assert kinds(steps) == [("a", "gap", 2)]
    assert "coasts" in steps.events[0].text and steps.events[0].time == 3.0
    np.testing.assert_array_equal(steps.dt, [1, 1, 1, 3, 1, 2])
    np.testing.assert_allclose(steps.due["a"].interval, 1.0)


def test_rows_without_a_period_have_no_gaps() -> None:
    assert merged(stream("a", [1, 2, 3, 6]), start=0.0).events == ()


def test_identical_rows_are_used_once() -> None:
    steps = merged(stream("a", [1, 2, 2, 2, 3], [[1.0], [2.0], [2.0], [2.0], [np.nan]]), start=0.0)
    assert kinds(steps) == [("a", "duplicate", 2)]
    np.testing.assert_array_equal(steps.due["a"].row, [0, 1, 4])
    lost = merged(stream("a", [1, 1], [[np.nan], [np.nan]]), start=0.0)
    assert kinds(lost) == [("a", "duplicate", 1)]


def test_rows_of_one_time_that_differ_are_refused() -> None:
    with pytest.raises(DataError, match=r"stream 'a': rows 2 and 3 have one time, 2 s, but differ") as caught:
        merged(stream("a", [1, 2, 2], [[1], [2], [3]]))
    assert caught.value.exit_code == 5


def test_time_that_goes_backwards_is_refused() -> None:
    with pytest.raises(DataError, match=r"time goes backwards at row 3: 1.5 s after 2 s[\s\S]*sort the rows"):
        merged(stream("a", [1, 2, 1.5, 3]))


@pytest.mark.parametrize("time", [np.nan, np.inf])
def test_a_time_that_is_none_is_refused(time: float) -> None:
    with pytest.raises(DataError, match="stream 'a': the time of row 2 is"):
        merged(stream("a", [1, time, 3]))


def test_rows_before_the_start_and_after_the_last_step_are_counted_and_not_used() -> None:
    driver = driving(np.arange(1.0, 6.0), 1.0)
    aid = stream("a", [0.5, 1.5, 2.5, 3.0, 4.0, 5.0, 7.0])
    steps = driven_steps(driver, 1, {"a": aid}, [Wanted("a", "a")], start=2.0)
    np.testing.assert_array_equal(steps.time, [3.0, 4.0, 5.0])
    np.testing.assert_array_equal(steps.due["a"].row, [3, 4, 5])
    assert sorted(kinds(steps)) == [("a", "after end", 1), ("a", "before start", 2), ("a", "crowded", 1)]


def test_of_several_rows_in_a_step_the_last_is_used() -> None:
    driver = driving(np.arange(1.0, 4.0), 1.0)
    steps = driven_steps(driver, 1, {"a": stream("a", [1.2, 1.5, 1.9, 3.0])}, [Wanted("a", "a")])
    np.testing.assert_array_equal(steps.due["a"].row, [-1, 2, 3])
    assert kinds(steps) == [("a", "crowded", 2)]


def test_rows_that_fill_no_step_are_left_over() -> None:
    driver = driving(np.arange(1.0, 9.0), 1.0)
    steps = driven_steps(driver, 3, {}, [])
    np.testing.assert_array_equal(steps.rows, [0, 3, 6])
    np.testing.assert_array_equal(steps.time, [3.0, 6.0])
    assert steps.start == 0.0
    assert kinds(steps) == [("imu", "left over", 2)]


def test_driving_rows_up_to_the_start_are_not_used() -> None:
    driver = driving(0.01 * np.arange(1, 101), 0.01)
    steps = driven_steps(driver, 2, {}, [], start=0.5)
    assert (steps.rows[0], len(steps)) == (50, 25)
    np.testing.assert_array_equal(steps.dt, 0.02)


@pytest.mark.parametrize(("rows", "per_step"), [(0, 1), (1, 2)])
def test_a_record_too_short_for_one_step_is_refused(rows: int, per_step: int) -> None:
    driver = driving(np.arange(1.0, 1.0 + rows), 1.0)
    with pytest.raises(DataError, match=f"has {rows} rows after the start, one step needs {per_step}"):
        driven_steps(driver, per_step, {}, [])


def test_no_rows_at_all_are_refused() -> None:
    with pytest.raises(DataError, match="the record has no rows"):
        merged(stream("a", []))
    with pytest.raises(DataError, match=r"no instant lies between the start 5 s and the end 2 s"):
        merged(stream("a", [1.0, 2.0]), start=5.0)


def test_a_stream_that_is_not_there_is_named_with_those_that_are() -> None:
    with pytest.raises(DataError, match=r"measurement 'fix' needs the stream 'gps'[\s\S]*it has: a; .*`stream: a`"):
        merged_steps({"a": stream("a", [1.0])}, [Wanted("fix", "gps")])


def test_a_pseudo_measurement_falls_due_at_its_interval_or_at_each_step() -> None:
    driver = driving(0.25 * np.arange(1, 13), 0.25)
    steps = driven_steps(driver, 1, {}, [Wanted("each", None), Wanted("second", None, 1.0)])
    np.testing.assert_array_equal(steps.due["each"].row, 0)
    np.testing.assert_array_equal(steps.due["each"].interval, 0.25)
    np.testing.assert_array_equal(steps.time[steps.due["second"].row >= 0], [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(steps.due["second"].interval, 1.0)


def test_a_pseudo_measurement_makes_steps_where_nothing_drives() -> None:
    steps = merged_steps({"a": stream("a", [0.9, 2.0])}, [Wanted("a", "a"), Wanted("still", None, 0.5)], start=0.0)
    np.testing.assert_allclose(steps.time, [0.5, 0.9, 1.0, 1.5, 2.0])
    np.testing.assert_array_equal(steps.due["still"].row, [0, -1, 0, 0, 0])


def test_a_stream_without_rows_is_due_nowhere_and_told() -> None:
    steps = merged(stream("a", [0.5, 1.0]), stream("b", []), start=0.0)
    np.testing.assert_array_equal(steps.due["b"].row, [-1, -1])
    assert kinds(steps) == [("b", "no rows", 1)]
