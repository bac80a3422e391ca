"""Row by row is as the whole record at once: the same rows, the same numbers, the same things told."""

from __future__ import annotations

from collections import Counter as Tally
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.data.preprocessing.counter import Counter, Output, counted
from estimfw.data.preprocessing.fir import LowPass, low_passed
from estimfw.data.preprocessing.joining import Joining, Method, joined
from estimfw.data.preprocessing.online import Layout, Layouts, Online, OnlineShift, Row
from estimfw.data.preprocessing.online_counter import OnlineCounter
from estimfw.data.preprocessing.online_fir import OnlineFir
from estimfw.data.preprocessing.online_join import OnlineJoin
from estimfw.data.preprocessing.shift import Clock, shifted
from estimfw.data.record import Event, Stream
from estimfw.errors import DataError, UsageError

FloatArray = NDArray[np.float64]


def layouts(*streams: Stream) -> Layouts:
    return {s.name: Layout(s.columns, s.kind, float(s.period or 0.0)) for s in streams}


def rows_of(*streams: Stream) -> list[Row]:
    """All rows in the order of time; of one instant in the order of the streams."""
    rows = [Row(s.name, float(t), s.values[k]) for s in streams for k, t in enumerate(s.time)]
    return sorted(rows, key=lambda row: row.time)


def fed(online: Online, *streams: Stream) -> tuple[list[Row], list[float]]:
    """What comes out, and how long after the newest row of that stream it did so."""
    out, delays = [], []
    for row in rows_of(*streams):
        made = list(online.push(row))
        out += made
        delays += [row.time - m.time for m in made]
    return [*out, *online.finish()], delays


def as_stream(like: Stream, rows: list[Row]) -> Stream:
    own = [row for row in rows if row.stream == like.name]
    time = np.array([row.time for row in own])
    return replace(like, time=time, values=np.array([row.values for row in own]).reshape(len(own), len(like.columns)))


def told(events: list[Event] | tuple[Event, ...], kinds: set[str]) -> dict[str, int]:
    tally: Tally[str] = Tally()
    for event in events:
        tally[event.kind] += event.count
    return {kind: count for kind, count in tally.items() if kind in kinds}


def same(made: Stream, due: Stream) -> None:
    assert made.time == pytest.approx(due.time, abs=1e-9)
    assert made.values == pytest.approx(due.values, abs=1e-9, nan_ok=True)


counts = st.lists(
    st.one_of(st.integers(0, 40), st.sampled_from(["reset", "missing", "spike", "missing"])), min_size=3, max_size=40
)


@settings(max_examples=150)
@given(counts, st.sampled_from(["rate", "increment", "count"]))
def test_a_counter_that_wraps_is_reset_loses_counts_and_has_spikes(steps: list[int | str], output: Output) -> None:
    now, values = 100.0, [100.0]
    for step in steps:
        if isinstance(step, int):
            now += step
        elif step == "reset":
            now = 0.0
        values.append({"missing": np.nan, "spike": 77777.0}.get(str(step), now % 256.0))
    time = np.asarray(0.1 * np.arange(len(values)), dtype=float)
    raw = Stream("odometer", time, np.array(values)[:, None], ("n",), "sample", 0.1)
    counter = Counter(0.04, modulus=256.0, fastest=20.0)
    due, events = counted(raw, {"n": "x"}, counter, output, "odometer")
    online = OnlineCounter(layouts(raw), "odometer", {"n": "x"}, counter, output, "odometer")
    out, _ = fed(online, raw)
    same(as_stream(due, out), due)
    kinds = {"missing", "spike", "wrap", "reset", "jump", "ambiguous"}
    assert told(online.events, kinds) == told(events, kinds)


@settings(max_examples=60)
@example(holes=[(61, 12, True), (73, 10, True)], longest=0.0, taps=40)  # more lost rows than half a window has
@given(
    st.lists(st.tuples(st.integers(0, 299), st.integers(1, 12), st.booleans()), max_size=5),
    st.sampled_from([0.0, 0.05]),
    st.sampled_from([40, 41]),
)
def test_a_low_pass_filter_over_holes_and_lost_rows(
    holes: list[tuple[int, int, bool]], longest: float, taps: int
) -> None:
    time = np.asarray(0.01 * np.arange(1, 301), dtype=float)
    values = np.random.default_rng(5).standard_normal((300, 2))
    lost = np.zeros(300, dtype=bool)
    for begin, length, gone in holes:
        values[begin : begin + length, int(gone)] = np.nan
        lost[begin : begin + length] |= gone and begin > 0
    raw = Stream("odometer", time[~lost], values[~lost], ("a", "b"), "mean", 0.01)
    low_pass = LowPass(6.0, taps=taps, longest_gap=longest)
    if (raw.time[-1] - raw.time[0]) / 0.01 + 1.5 < taps:
        return
    due, events = low_passed(raw, ("a", "b"), low_pass, "smooth")
    online = OnlineFir(layouts(raw), "odometer", ("a", "b"), low_pass, "smooth")
    out, _ = fed(online, raw)
    same(as_stream(due, out), due)
    assert told(online.events, {"missing", "bridged"}) == told(events, {"missing", "bridged"})


def test_the_filter_is_as_late_as_it_says_and_no_later() -> None:
    time = np.asarray(0.01 * np.arange(1, 1001), dtype=float)
    raw = Stream("odometer", time, np.ones((1000, 1)), ("v",), "mean", 0.01)
    online = OnlineFir(layouts(raw), "odometer", (), LowPass(0.5, taps=400), "odometer")
    _, delays = fed(online, raw)
    assert max(delays) == pytest.approx(online.layouts["odometer"].latency) == pytest.approx(2.0)


@settings(max_examples=60)
@given(
    st.sampled_from(["linear", "last", "difference", "rate"]),
    st.lists(st.tuples(st.integers(0, 39), st.integers(1, 6), st.booleans()), max_size=4),
    st.sampled_from([None, 0.35]),
    st.booleans(),
)
def test_a_join_over_gaps_and_missing_readings(
    method: Method, holes: list[tuple[int, int, bool]], reach: float | None, means: bool
) -> None:
    target_time = np.asarray(0.05 * np.arange(1, 85), dtype=float)
    target = Stream("imu", target_time, target_time[:, None], ("t",), "increment", 0.05)
    time = np.asarray(0.31 + 0.1 * np.arange(40), dtype=float)
    values, lost = np.random.default_rng(6).standard_normal((40, 1)), np.zeros(40, dtype=bool)
    for begin, length, gone in holes:
        values[begin : begin + length] = np.nan
        lost[begin : begin + length] |= gone and begin > 0 and begin + length < 40
    source = Stream("odometer", time[~lost], values[~lost], ("v",), "mean" if means else "sample", 0.1)
    due, events = joined(target, source, {"v": "v"}, Joining(method, reach))
    online = OnlineJoin(layouts(target, source), "odometer", "imu", {"v": "v"}, Joining(method, reach))
    out, _ = fed(online, source, target)
    same(as_stream(due, out), due)
    kinds = {"cut", "missing", "bridged"}
    assert told(online.events, kinds) == told(events, kinds)


@pytest.mark.parametrize("clock", [Clock(latency=0.3), Clock(offset=-5.0, drift=1e-4, since=20.0)])
def test_a_shift(clock: Clock) -> None:
    time = np.asarray(0.1 * np.arange(40), dtype=float)
    raw = Stream("odometer", time, time[:, None], ("v",), "sample", 0.1)
    out, _ = fed(OnlineShift(layouts(raw), "odometer", clock), raw)
    same(as_stream(raw, out), shifted(raw, clock))


@pytest.mark.parametrize(
    "make",
    [
        lambda known: OnlineFir(known, "odometer", (), LowPass(2.0, taps=20), "odometer"),
        lambda known: OnlineCounter(known, "odometer", {"v": "v"}, Counter(1.0), "rate", "odometer"),
        lambda known: OnlineJoin(known, "odometer", "imu", {"v": "v"}, Joining()),
    ],
)
def test_rows_out_of_order_and_streams_that_nobody_told_of_are_refused(make: Callable[[Layouts], Online]) -> None:
    layout = Layout(("v",), "sample", 0.1)
    online = make({"odometer": layout, "imu": layout})
    online.push(Row("odometer", 1.0, np.ones(1)))
    with pytest.raises(UsageError, match=r"a row at 0.9 s after one at 1 s"):
        online.push(Row("odometer", 0.9, np.ones(1)))
    with pytest.raises(UsageError, match="not told what the rows of 'odometer' are"):
        make({"imu": layout})


def test_a_hole_that_is_refused_on_the_whole_record_is_refused_row_by_row() -> None:
    time = np.asarray(0.1 * np.arange(1, 41), dtype=float)
    target = Stream("imu", time, time[:, None], ("t",), "increment", 0.1)
    source = Stream("odometer", np.delete(time, range(10, 20)), np.ones((30, 1)), ("v",), "sample", 0.1)
    joining = Joining(missing="refuse")
    with pytest.raises(DataError, match=r"no reading of odometer at 1.1 s") as whole:
        joined(target, source, {"v": "v"}, joining)
    with pytest.raises(DataError) as by_row:
        fed(OnlineJoin(layouts(target, source), "odometer", "imu", {"v": "v"}, joining), source, target)
    assert str(by_row.value) == str(whole.value)
