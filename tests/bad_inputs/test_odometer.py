"""An IMU with an odometer whose log is bad (33 to 40, 43, 49): each is refused with a guess, or flagged and not used."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Odometer = Callable[..., Any]
Rows = list[tuple[float, float]]

WHEEL = """\
  odometer:
    kind: direct
    of: [{block: velocity_error, axes: [E]}]
    noise: 100 m/s
    stream: imu
    columns: [speed]
aiding:
  wheel: {kind: log, streams: {odometer: {file: odometer.csv, rate: 10 Hz}}}
preprocess:
"""
PULSES = "pulses: {kind: counter, stream: odometer, columns: {pulses: speed}, scale: 0.04 m, modulus: 65536, fastest: 70 m/s}"
ONTO = "onto: {kind: join, stream: odometer, onto: imu, columns: {speed: speed}}"


def drive(begin: float = 0.0) -> Rows:
    """20 s at 10 m/s and 10 Hz: 25 pulses a row, from 1000 on."""
    return [(begin + 0.1 * k, 1000.0 + 25 * k) for k in range(201)]


@pytest.fixture
def odometer(check: Odometer, standing: str, imu: Any, folder: Path) -> Odometer:
    """Runs the filter of a standing vehicle, its odometer's speed joined onto the IMU, on such an odometer log."""

    def run(
        rows: Rows,
        *settings: str,
        steps: Sequence[str] = (PULSES, ONTO),
        log: str | None = None,
        column: str = "pulses",
    ) -> Any:
        (folder / "log.csv").write_text(log if log is not None else imu.csv())
        text = f"time,{column}\n" + "".join(f"{t:.3f},{'' if np.isnan(x) else x:}\n" for t, x in rows)
        (folder / "odometer.csv").write_text(text)
        head, tail = standing.split("estimator:")
        config = head + WHEEL + "".join(f"  {step}\n" for step in steps) + "estimator:" + tail
        settings = ("estimator.discretisation={method: series}", *settings)  # quick, and good enough here
        return check(config, "--json", *[w for s in settings for w in ("--set", s)], command="run")

    return run


def flagged(told: Any, source: str) -> dict[str, Any]:
    """The events of a stream by kind, of a run that went well."""
    assert told.code == 0, told.err + told.out
    return {e["kind"]: e for e in json.loads(told.out)["events"] if e["source"] == source}


def odometry(told: Any) -> dict[str, int]:
    measured: dict[str, int] = json.loads(told.out)["measurements"]["odometer"]
    return measured


def test_a_good_odometer_is_fused_at_each_step_and_nothing_but_the_last_row_is_cut(odometer: Odometer) -> None:
    told = odometer(drive())
    assert flagged(told, "odometer") == {}
    # Speeds stand in the middle of their intervals: after 19.95 s there is none.
    assert {k: e["count"] for k, e in flagged(told, "imu").items()} == {"cut": 1}
    assert odometry(told)["fused"] == 199


def test_33_missing_counts_are_flagged_and_only_their_steps_go_without(odometer: Odometer) -> None:
    rows = drive()
    rows[50:53] = [(t, np.nan) for t, _ in rows[50:53]]
    told = odometer(rows)
    assert flagged(told, "odometer")["missing"]["count"] == 3
    assert flagged(told, "imu")["missing"]["count"] == 5
    assert (odometry(told)["missing"], odometry(told)["fused"]) == (5, 194)


def test_34_a_lost_imu_sample_is_bridged_and_told_and_the_odometer_stands_at_its_place(
    odometer: Odometer, imu: Any
) -> None:
    told = odometer(drive(), log=imu.changed((slice(100, 101), 1), lambda x: x * np.nan).csv())
    kinds = flagged(told, "imu")
    assert set(kinds) == {"cut", "repeated"}
    assert kinds["repeated"]["count"] == 1
    assert odometry(told)["fused"] == 199


def test_35_a_gap_of_the_odometer_is_flagged_and_left_empty_or_bridged_where_the_config_says_so(
    odometer: Odometer,
) -> None:
    rows = drive()
    del rows[50:60]
    told = odometer(rows)
    gap = flagged(told, "odometer")["gap"]
    assert (gap["count"], gap["time"]) == (10, pytest.approx(4.9))
    assert odometry(told)["missing"] == flagged(told, "imu")["missing"]["count"] == 12
    told = odometer(rows, "preprocess.onto.longest_gap=1.2 s")
    assert flagged(told, "imu")["bridged"]["count"] == 12
    assert odometry(told)["missing"] == 0
    told = odometer(rows, "preprocess.onto.missing=refuse")
    assert told.code == 5
    told.says(
        "filter.yaml:22:9: preprocess 'onto': no reading of odometer at 4.9 s, nor any two around it within 0.15 s"
    )


def test_35_a_gap_of_the_imu_beyond_the_limit_is_refused(odometer: Odometer, imu: Any) -> None:
    lines = imu.csv().splitlines(keepends=True)
    told = odometer(drive(), log="".join([*lines[:100], *lines[110:]]))
    assert told.code == 5
    told.says("log.csv:101: a gap of 1.1 s after 9.9 s")


def test_36_an_odometer_whose_time_goes_backwards_is_refused(odometer: Odometer) -> None:
    rows = drive()
    rows[100] = (9.0, rows[100][1])
    told = odometer(rows)
    assert told.code == 5
    told.says("odometer.csv:102: time goes backwards, from 9.9 s to 9 s", "`time_errors: drop`")
    told = odometer(rows, "aiding.wheel.streams.odometer.time_errors=drop")
    assert flagged(told, "odometer")["time order"]["count"] == 1
    assert flagged(told, "odometer")["gap"]["count"] == 1


def test_37_identical_odometer_rows_are_dropped_and_differing_ones_refused(odometer: Odometer) -> None:
    rows = drive()
    told = odometer([*rows[:101], *rows[100:]])
    assert flagged(told, "odometer")["duplicate"]["count"] == 1
    assert odometry(told)["fused"] == 199
    told = odometer([*rows[:101], (10.0, 3503.0), *rows[101:]])
    assert told.code == 5
    told.says("two different rows have the time stamp 10 s")


def test_38_a_late_odometer_is_put_at_its_instants_by_its_latency_and_what_is_lost_is_told(odometer: Odometer) -> None:
    late = drive(begin=0.3)
    clock = "clock: {kind: shift, stream: odometer, latency: 300 ms}"
    told, in_time = odometer(late, steps=(clock, PULSES, ONTO)), odometer(drive())
    late_states, states = json.loads(told.out)["states"], json.loads(in_time.out)["states"]
    for label, state in states.items():
        assert late_states[label]["value"] == pytest.approx(state["value"], rel=1e-9)
    cut = flagged(odometer(late), "imu")["cut"]
    assert (cut["count"], cut["time"]) == (3, pytest.approx(0.1))
    assert "3 before 0.4 s, 0 after 20 s" in cut["text"]


def test_38_a_late_odometer_that_nobody_told_of_shows_against_the_accelerometers(odometer: Odometer, imu: Any) -> None:
    def speed(t: Any) -> Any:
        return 10.0 + 2.0 * np.sin(0.9 * t) + np.cos(2.1 * t)

    time = 0.1 * np.arange(1, 201)
    log = imu.changed((slice(None), 5), lambda x: x + speed(time) - speed(time - 0.1)).csv()
    distance = np.concatenate([[0.0], np.cumsum(0.1 * speed(time - 0.05))])
    late = [(0.1 * k + 0.3, float(np.floor(distance[k] / 0.001))) for k in range(201)]
    pulses = PULSES.replace("0.04 m", "0.001 m")
    clock = "clock: {kind: shift, stream: odometer, latency: 0.3 s}"
    watch = "watch: {kind: lag_check, stream: imu, column: speed, against: dvel_y}"
    told = odometer(late, "source.checks=false", steps=(pulses, ONTO, watch), log=log)
    assert "speed lags dvel_y by 0.3" in flagged(told, "imu")["lag"]["text"]
    assert "lag" not in flagged(
        odometer(late, "source.checks=false", steps=(clock, pulses, ONTO, watch), log=log), "imu"
    )
    strict = watch.replace("dvel_y", "dvel_y, action: refuse")
    told = odometer(late, "source.checks=false", steps=(pulses, ONTO, strict), log=log)
    assert told.code == 5
    told.says("preprocess 'watch': stream 'imu': speed lags dvel_y by 0.3", "filter.yaml:23:10")


def test_39_an_odometer_on_gps_time_is_refused_with_the_offset_that_cures_it(odometer: Odometer) -> None:
    week = drive(begin=604800.0)
    told = odometer(week)
    assert told.code == 5
    told.says("preprocess 'onto': odometer goes from 604800.1 to 604820 s, imu from 0.1 to 20 s: no common time")
    told.says("a GPS week (604800 s)?", "{kind: shift, stream: odometer, offset: 604800 s}")
    told.says("filter.yaml:22:9")
    clock = "clock: {kind: shift, stream: odometer, offset: 604800 s}"
    assert odometry(odometer(week, steps=(clock, PULSES, ONTO)))["fused"] == 199


@pytest.mark.parametrize("jump", [604800.0, 3600.0])
def test_39_an_odometer_clock_that_jumps_is_refused(odometer: Odometer, jump: float) -> None:
    rows = [(t + jump * (t > 10.0), x) for t, x in drive()]
    told = odometer(rows)
    assert told.code == 5
    told.says(f"stream 'odometer': the time jumps from 10 s to {10.1 + jump:.10g} s", f"({jump:.0f} s)?")


def test_39_a_clock_that_drifts_is_set_right(odometer: Odometer) -> None:
    fast = [(1.02 * t, x) for t, x in drive()]
    clock = "clock: {kind: shift, stream: odometer, drift: 2 %}"
    told = odometer(fast, "aiding.wheel.streams.odometer.rate=null", steps=(clock, PULSES, ONTO))
    assert flagged(told, "odometer") == {}
    assert odometry(told)["fused"] == 199


def test_40_rates_other_than_configured_are_refused(odometer: Odometer) -> None:
    told = odometer(drive(), "aiding.wheel.streams.odometer.rate=100 Hz")
    assert told.code == 5
    told.says("odometer.csv: the time stamps are 0.1 s apart (10 Hz), the sampling interval is 0.01 s (100 Hz)")
    told = odometer(drive(), "preprocess.pulses.rate=100 Hz")
    assert told.code == 5
    told.says("preprocess 'pulses': stream 'odometer': the time stamps are 0.1 s apart", "0.01 s (100 Hz)")
    told = odometer([(1000.0 * t, x) for t, x in drive()])
    assert told.code == 5
    told.says("odometer.csv: the time stamps are 100 s apart", "time in ms, not in s?")


def test_43_a_speed_that_is_stuck_is_flagged_and_not_used_any_more(odometer: Odometer) -> None:
    rng = np.random.default_rng(4)
    rows = [(t, round(10.0 + rng.uniform(), 3)) for t, _ in drive()]
    rows[100:] = [(t, rows[100][1]) for t, _ in rows[100:]]
    frozen = "frozen: {kind: stuck, stream: odometer, columns: [speed], longest: 2 s}"
    told = odometer(rows, steps=(frozen, ONTO), column="speed")
    stuck = flagged(told, "odometer")["stuck"]
    assert (stuck["count"], stuck["time"]) == (100, pytest.approx(10.1))
    assert (odometry(told)["fused"], odometry(told)["missing"]) == (100, 100)
    standing = [(t, 0.0) for t, _ in rows]
    assert flagged(odometer(standing, steps=(frozen, ONTO), column="speed"), "odometer") == {}


def test_49_a_counter_that_wraps_is_unwrapped_and_told(odometer: Odometer) -> None:
    told = odometer([(t, (x + 62000.0) % 65536.0) for t, x in drive()])
    assert flagged(told, "odometer")["wrap"]["count"] == 1
    assert json.loads(told.out)["states"] == json.loads(odometer(drive()).out)["states"]


def test_49_a_counter_that_is_reset_loses_one_interval_and_is_told(odometer: Odometer) -> None:
    told = odometer([(t, x if t < 10.0 else x - 3500.0) for t, x in drive()])
    assert {k: e["count"] for k, e in flagged(told, "odometer").items()} == {"reset": 1}
    assert odometry(told)["missing"] == flagged(told, "imu")["missing"]["count"] == 2


@pytest.mark.parametrize("pulses", [40.0, -25.0], ids=["49-slip", "49-lost-pulses"])
def test_49_a_slipping_wheel_and_lost_pulses_are_left_out_and_told(odometer: Odometer, pulses: float) -> None:
    rows = [(t, x + pulses * min(max(k - 100, 0), 10)) for k, (t, x) in enumerate(drive())]
    limit = "slip: {kind: jump_limit, stream: odometer, columns: [speed], rate: 5 m/s^2, longest: 2 s}"
    told = odometer(rows, steps=(PULSES, limit, ONTO))
    jump = flagged(told, "odometer")["jump"]
    assert (jump["count"], jump["time"]) == (10, pytest.approx(10.1))
    assert odometry(told)["missing"] == flagged(told, "imu")["missing"]["count"] > 0


def test_49_counts_that_no_vehicle_makes_are_not_used_and_told(odometer: Odometer) -> None:
    rows = drive()
    rows[100] = (10.0, 65000.0)
    assert flagged(odometer(rows), "odometer")["spike"]["count"] == 1
    later = [(t, x + 20000.0 * (t > 9.95)) for t, x in drive()]
    assert flagged(odometer(later), "odometer")["jump"]["count"] == 1


def test_a_number_that_is_no_count_is_refused(odometer: Odometer) -> None:
    rows = drive()
    rows[100] = (10.0, 3500.5)
    told = odometer(rows)
    assert told.code == 5
    told.says("stream 'odometer': pulses is 3500.5 at 10 s, which is no count of pulses")
