"""Columns put onto other stamps: a known motion comes out as it is, and what is not known is empty and told."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.data.preprocessing.joining import Joining, Method, joined
from estimfw.data.preprocessing.shift import Clock, shifted
from estimfw.data.record import Event, Stream
from estimfw.errors import DataError

FloatArray = NDArray[np.floating[Any]]


def imu(start: float = 0.0, count: int = 1000, period: float = 0.01) -> Stream:
    time = start + period * np.arange(1, count + 1)
    return Stream(
        "imu", np.asarray(time, dtype=float), np.arange(count, dtype=float)[:, None], ("gyro",), "increment", period
    )


def odometer(
    motion: Callable[[FloatArray], FloatArray], *, begin: float = 1.0, end: float = 8.0, kind: str = "sample"
) -> Stream:
    time = np.arange(begin, end + 1e-9, 0.1)
    values = motion(time - (0.05 if kind == "mean" else 0.0))
    assert kind in ("mean", "sample")
    return Stream(
        "odometer",
        time,
        np.asarray(values[:, None], dtype=float),
        ("speed",),
        "mean" if kind == "mean" else "sample",
        0.1,
    )


def join(
    target: Stream, source: Stream, method: Method = "linear", longest_gap: float | None = None
) -> tuple[Stream, FloatArray, dict[str, Event]]:
    made, events = joined(target, source, {"speed": "v"}, Joining(method, longest_gap))
    return made, np.asarray(made.values[..., -1]), {e.kind: e for e in events}


@pytest.mark.parametrize("kind", ["sample", "mean"])
def test_a_ramp_comes_out_at_each_instant_and_means_stand_in_the_middle_of_their_intervals(kind: str) -> None:
    made, speed, _ = join(imu(), odometer(lambda t: 4.0 - 0.5 * t, kind=kind))
    assert made.columns == ("gyro", "v")
    assert made.kind == "increment"
    assert speed == pytest.approx(4.0 - 0.5 * made.time, abs=1e-12)


def test_rows_outside_of_the_readings_are_cut_and_told_and_the_others_keep_their_columns() -> None:
    made, _, events = join(imu(), odometer(np.sin))
    assert (made.time[0], made.time[-1]) == (pytest.approx(1.0), pytest.approx(8.0))
    assert made.values[:, 0] == pytest.approx(np.arange(99, 800))
    assert events["cut"].count == 299
    assert "99 before 1 s, 200 after 8 s" in events["cut"].text


def test_stamps_that_coincide_take_the_reading_as_it_is() -> None:
    source = odometer(lambda t: np.random.default_rng(2).standard_normal(t.size))
    made, speed, _ = join(imu(), source)
    hits = np.flatnonzero(np.isclose(made.time[:, None], source.time, atol=1e-9).any(axis=1))
    assert hits.size == len(source)
    assert np.array_equal(speed[hits], source.values[:, 0])


def test_the_last_reading_is_held_until_the_next_one_and_no_longer_than_it_is_trusted() -> None:
    source = odometer(lambda t: np.round(10.0 * t))
    made, speed, _ = join(imu(), source, "last")
    inside = made.time <= source.time[-1]
    assert speed[inside] == pytest.approx(np.floor(10.0 * made.time[inside] + 1e-6))
    assert made.time[-1] == pytest.approx(8.15)


@pytest.mark.parametrize("method", ["difference", "rate"])
def test_a_distance_gives_what_was_driven_in_each_interval(method: Method) -> None:
    made, gained, _ = join(imu(), odometer(lambda t: 3.0 * t), method)
    assert gained == pytest.approx(np.full(len(made), 3.0 * (0.01 if method == "difference" else 1.0)))
    assert made.time[0] == pytest.approx(1.01)
    total = join(imu(), odometer(lambda t: t**2), "difference")[1].sum()
    assert total == pytest.approx(8.0**2 - 1.0)


def test_a_gap_leaves_the_column_empty_and_is_told_or_is_bridged_where_that_is_allowed() -> None:
    whole = odometer(lambda t: 2.0 * t)
    kept = np.delete(np.arange(len(whole)), np.arange(30, 36))
    source = Stream("odometer", whole.time[kept], whole.values[kept], whole.columns, "sample", 0.1)
    made, speed, events = join(imu(), source)
    lost = (made.time > 3.9 + 1e-9) & (made.time < 4.6 - 1e-9)
    assert np.array_equal(np.isnan(speed), lost)
    assert events["missing"].count == lost.sum() == 69
    assert speed[~lost] == pytest.approx(2.0 * made.time[~lost])
    made, speed, events = join(imu(), source, longest_gap=0.7)
    assert speed == pytest.approx(2.0 * made.time)
    assert events["bridged"].count == 69
    assert "missing" not in events


def test_a_reading_that_is_missing_is_as_a_row_that_is_not_there() -> None:
    source = odometer(lambda t: 2.0 * t)
    source.values[30:36] = np.nan
    _, speed, events = join(imu(), source)
    assert events["missing"].count == np.isnan(speed).sum() == 69


@pytest.mark.parametrize(("offset", "guess"), [(604800.0, 604800.0), (-3600.0, -3600.0), (500.0, 500.99)])
def test_clocks_without_common_time_are_refused_with_a_guess_that_cures_it(offset: float, guess: float) -> None:
    late = shifted(odometer(np.sin), Clock(offset=-offset))
    with pytest.raises(DataError, match="no common time") as told:
        join(imu(), late)
    # A known jump is taken as it is; else both are taken to begin together, here 0.99 s apart.
    assert f"offset: {guess:.6g} s" in str(told.value.hint)
    cured = shifted(late, Clock(offset=guess))
    assert len(join(imu(), cured)[0]) == 701


@pytest.mark.parametrize(
    ("time", "told"),
    [
        ([0.0, 0.1, 0.05, 0.2], "time goes backwards, from 0.1 s to 0.05 s"),
        ([0.0, 0.1, 0.1, 0.2], "two different rows have the time stamp 0.1 s"),
        ([0.0, 0.1, 604800.2, 604800.3], "the time jumps from 0.1 s to 604800.2 s: a GPS week"),
        ([0.0, 0.1, np.nan, 0.3], "row 3 has no time stamp"),
        ([0.0, 0.5, 1.0, 1.5], "the time stamps are 0.5 s apart"),
    ],
)
def test_times_that_are_none_are_refused(time: list[float], told: str) -> None:
    source = Stream("odometer", np.array(time), np.arange(4.0)[:, None], ("speed",), "sample", 0.1)
    with pytest.raises(DataError, match=f"'odometer': {told}"):
        join(imu(), source)


def test_identical_rows_are_used_once_and_told() -> None:
    source = odometer(lambda t: 2.0 * t)
    twice = Stream(
        "odometer", np.insert(source.time, 20, source.time[19]), np.insert(source.values, 20, source.values[19], axis=0),
        source.columns, "sample", 0.1,
    )  # fmt: skip
    made, speed, events = join(imu(), twice)
    assert speed == pytest.approx(2.0 * made.time)
    assert (events["duplicate"].source, events["duplicate"].count) == ("odometer", 1)


def test_increments_and_columns_that_are_taken_are_refused() -> None:
    with pytest.raises(DataError, match="holds increments over its own intervals"):
        joined(odometer(np.sin), imu(), {"gyro": "g"}, Joining())
    with pytest.raises(DataError, match="has a column 'gyro' already"):
        joined(imu(), odometer(np.sin), {"speed": "gyro"}, Joining())


def test_runs_side_by_side_are_as_each_alone() -> None:
    source = odometer(np.sin)
    runs = np.random.default_rng(1).standard_normal((3, len(source), 1))
    runs[1, 5] = np.nan
    target = imu()
    together = Stream("odometer", source.time, runs, source.columns, "sample", 0.1)
    leading = Stream("imu", target.time, np.stack([target.values] * 3), target.columns, "increment", 0.01)
    made = join(leading, together)[1]
    alone = [join(target, Stream("odometer", source.time, r, source.columns, "sample", 0.1))[1] for r in runs]
    assert np.array_equal(made, alone, equal_nan=True)


@pytest.mark.parametrize("clock", [Clock(0.05, 0.2, 2e-5, 100.0), Clock(offset=-3.0), Clock(drift=-0.01)])
def test_a_shifted_stream_stands_at_the_instants_that_its_clock_was_read(clock: Clock) -> None:
    true = np.arange(1.0, 8.0, 0.1)
    stamps = true + clock.latency + clock.offset + clock.drift * (true - clock.since)
    raw = Stream("odometer", stamps, true[:, None], ("speed",), "sample", 0.1 * (1.0 + clock.drift))
    made = shifted(raw, clock)
    assert made.time == pytest.approx(true, abs=1e-12)
    assert made.period == pytest.approx(0.1)
