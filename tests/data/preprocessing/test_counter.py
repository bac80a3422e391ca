"""Counts of pulses: whatever the counter does, no pulse is invented, and what is not known is told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.data.preprocessing.counter import Counter, counted
from estimfw.data.record import Event, Stream
from estimfw.errors import DataError

FloatArray = NDArray[np.floating[Any]]


def stream(counts: FloatArray | list[float], period: float = 0.1) -> Stream:
    values = np.asarray(counts, dtype=float)
    time = period * np.arange(values.shape[-1])
    return Stream("odometer", np.asarray(time, dtype=float), values[..., None], ("pulses",), "sample", period)


def speeds(made: Stream) -> FloatArray:
    return np.asarray(made.values[..., 0])


def rate(counts: FloatArray | list[float], counter: Counter) -> tuple[FloatArray, dict[str, Event]]:
    made, events = counted(stream(counts), {"pulses": "speed"}, counter, "rate", "odometer")
    assert (made.columns, made.kind) == (("speed",), "mean")
    return speeds(made), {e.kind: e for e in events}


@given(
    st.lists(st.integers(min_value=0, max_value=40), min_size=2, max_size=60),
    st.integers(min_value=0, max_value=255),
)
def test_a_wrapped_counter_gives_the_speeds_and_the_distance_of_one_that_never_wraps(
    steps: list[int], begin: int
) -> None:
    true = begin + np.concatenate([[0], np.cumsum(steps)])
    counter = Counter(0.04, modulus=256.0, fastest=40 * 0.04 / 0.1)
    made, _ = rate(true % 256.0, counter)
    assert made == pytest.approx(np.array(steps) * 0.04 / 0.1)
    distance, _ = counted(stream(true % 256.0), {"pulses": "x"}, counter, "count", "odometer")
    assert np.diff(speeds(distance)) == pytest.approx(np.array(steps) * 0.04)
    assert len(distance) == len(steps) + 1


@given(st.lists(st.integers(min_value=-40, max_value=40), min_size=2, max_size=60))
def test_a_counter_that_counts_both_ways_wraps_at_both_ends(steps: list[int]) -> None:
    true = np.concatenate([[0], np.cumsum(steps)])
    made, _ = rate(true % 256.0, Counter(0.5, modulus=256.0, fastest=40 * 0.5 / 0.1, both=True))
    assert made == pytest.approx(np.array(steps) * 0.5 / 0.1)


def test_a_wrap_is_counted_and_a_reset_is_told_from_it() -> None:
    counter = Counter(1.0, modulus=1000.0, fastest=100.0)
    made, events = rate([980.0, 990.0, 0.0, 10.0, 20.0], counter)
    assert made == pytest.approx([100.0] * 4)
    assert (events["wrap"].count, events["wrap"].time) == pytest.approx((1, 0.2))
    made, events = rate([480.0, 490.0, 0.0, 10.0, 20.0], counter)
    assert "wrap" not in events
    assert (events["reset"].count, events["reset"].time) == pytest.approx((1, 0.2))
    assert np.isnan(made[1])
    assert made[[0, 2, 3]] == pytest.approx([100.0] * 3)


def test_the_distance_goes_on_after_a_reset_with_the_pulses_since_then() -> None:
    made, _ = counted(stream([480.0, 490.0, 4.0, 14.0]), {"pulses": "x"}, Counter(1.0, None, 100.0), "count", "o")
    assert speeds(made).tolist() == [480.0, 490.0, 494.0, 504.0]


def test_missing_counts_are_flagged_and_their_pulses_are_in_the_next_increment_but_make_no_rate() -> None:
    made, events = rate([0.0, 3.0, np.nan, np.nan, 12.0, 15.0], Counter(1.0))
    assert made[[0, 4]] == pytest.approx([30.0, 30.0])
    assert np.isnan(made[1:4]).all()
    kept, _ = counted(stream([0.0, 3.0, np.nan, np.nan, 12.0, 15.0]), {"pulses": "n"}, Counter(1.0), "increment", "o")
    assert speeds(kept)[[0, 3, 4]].tolist() == [3.0, 9.0, 3.0]
    assert events["missing"].count == 2


def test_lost_rows_are_a_gap_over_which_there_is_no_rate() -> None:
    whole = stream(3.0 * np.arange(20))
    kept = np.delete(np.arange(20), [7, 8, 9])
    lost = Stream("odometer", whole.time[kept], whole.values[kept], whole.columns, "sample", 0.1)
    made, events = counted(lost, {"pulses": "speed"}, Counter(1.0), "rate", "odometer")
    assert np.delete(speeds(made), 6) == pytest.approx(np.full(15, 30.0))
    assert np.isnan(speeds(made)[6])
    (gap,) = events
    assert (gap.kind, gap.count) == ("gap", 3)
    assert gap.time == pytest.approx(0.6)


def test_a_single_impossible_count_is_left_out() -> None:
    made, events = rate([0.0, 1.0, 2.0, 900.0, 4.0, 5.0, 6.0], Counter(1.0, fastest=50.0))
    assert events["spike"].count == 1
    assert np.isnan(made[2:4]).all()
    assert made[[0, 1, 4, 5]] == pytest.approx([10.0] * 4)


def test_pulses_that_no_vehicle_makes_are_a_jump() -> None:
    made, events = rate([0.0, 1.0, 900.0, 901.0, 902.0], Counter(1.0, fastest=50.0))
    assert events["jump"].count == 1
    assert np.isnan(made[1])
    assert made[[0, 2, 3]] == pytest.approx([10.0] * 3)


def test_after_a_silence_in_which_it_may_have_wrapped_twice_nothing_is_claimed() -> None:
    counts = np.array([0.0, 5.0, *[np.nan] * 50, 7.0, 12.0])
    made, events = rate(counts, Counter(1.0, modulus=100.0, fastest=60.0))
    kept, _ = counted(stream(counts), {"pulses": "n"}, Counter(1.0, modulus=100.0, fastest=60.0), "increment", "o")
    assert events["ambiguous"].count == 1
    assert np.isnan(speeds(kept)[51])
    assert made[52] == pytest.approx(50.0)


def test_numbers_that_are_no_counts_are_refused_with_their_instant() -> None:
    with pytest.raises(DataError, match=r"pulses is 2.5 at 0.2 s, which is no count"):
        rate([0.0, 1.0, 2.5], Counter(1.0))


def test_another_rate_than_the_configured_one_is_refused() -> None:
    with pytest.raises(DataError, match=r"0.1 s apart \(10 Hz\), the sampling interval is 0.01 s"):
        rate([0.0, 1.0, 2.0], Counter(1.0, rate=100.0))


def test_runs_side_by_side_are_as_each_alone() -> None:
    runs = np.array([[990.0, 0.0, 10.0, 20.0], [0.0, 10.0, np.nan, 30.0]])
    counter = Counter(1.0, modulus=1000.0, fastest=200.0)
    together, events = rate(runs, counter)
    alone = [rate(run, counter)[0] for run in runs]
    assert np.array_equal(together, alone, equal_nan=True)
    assert {kind: e.count for kind, e in events.items()} == {"missing": 1, "wrap": 1}
