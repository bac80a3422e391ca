"""References that go bad while the filter runs (35, 38, 43, 44): each is flagged, not used, and the filter goes on."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Check = Callable[..., Any]
Reference = Callable[..., dict[str, Any]]


def rows(count: int = 200) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Fixes (t, x, y) at 2 Hz along a line, with 1 m of noise."""
    t = 0.5 * np.arange(1, count + 1)
    return np.column_stack([t, np.stack([2.0 * t, -t], axis=1) + np.random.default_rng(4).standard_normal((count, 2))])


@pytest.fixture
def reference(check: Check, logged: str, folder: Path) -> Reference:
    """The answer of a run of the tracker on these fixes, with these steps of preprocessing and further settings."""

    def run(log: Any, *preprocess: str, settings: tuple[str, ...] = ()) -> dict[str, Any]:
        lines = [",".join("" if np.isnan(c) else repr(float(c)) for c in row) for row in log]
        (folder / "fix.csv").write_text("\n".join(["time,x,y", *lines]) + "\n")
        steps = "".join(f"  step{i}: {step}\n" for i, step in enumerate(preprocess))
        config = logged + (f"preprocess:\n{steps}" if steps else "")
        told = check(config, "--json", *[w for s in settings for w in ("--set", s)], command="run")
        assert told.code == 0, told.err + told.out
        answer: dict[str, Any] = json.loads(told.out)
        return answer

    return run


def events(answer: dict[str, Any], kind: str) -> list[tuple[str, float, int]]:
    return [(e["source"], e["time"], e["count"]) for e in answer["events"] if e["kind"] == kind]


def told(answer: dict[str, Any], kind: str) -> str:
    return str(next(e["text"] for e in answer["events"] if e["kind"] == kind))


def assert_as_without(answer: dict[str, Any], less: dict[str, Any]) -> None:
    """What a bad reading did to the estimate: nothing."""
    for label, state in less["states"].items():
        assert answer["states"][label]["value"] == pytest.approx(state["value"], rel=1e-9)
        assert answer["states"][label]["sigma"] == pytest.approx(state["sigma"], rel=1e-9)


CLIP = "{kind: clip_check, stream: fix, columns: [x], lowest: -500 m, highest: 150 m}"
STUCK = "{kind: stuck, stream: fix, columns: [x, y], longest: 5 s}"


def test_44_a_clipped_reference_is_flagged_and_its_readings_are_not_used(reference: Reference) -> None:
    """The vehicle leaves the range of the x sensor at about 75 s; y goes on."""
    log = rows()
    clipped = log[:, 1] >= 150.0
    shown, holed = log.copy(), log.copy()
    shown[:, 1], holed[clipped, 1] = np.minimum(log[:, 1], 150.0), np.nan
    answer = reference(shown, CLIP)
    first = float(log[np.argmax(clipped), 0])
    assert events(answer, "clipped") == [("fix", first, int(clipped.sum()))]
    assert f"x is at the end of its range, 150, from {first:g} s" in told(answer, "clipped")
    assert events(answer, "missing") == [("fix", first, int(clipped.sum()))]
    assert_as_without(answer, reference(holed))
    assert_as_without(reference(shown, CLIP.replace("lowest: -500 m, highest: 150 m", "repeated: 3")), reference(holed))
    # Believed, the clipped readings would hold the estimate back, and sigma would not show it.
    believed = reference(shown, CLIP.replace("}", ", then: flag}"), settings=("estimator.gate=null",))
    assert events(believed, "clipped") == events(answer, "clipped")
    assert believed["states"]["position[x]"]["value"] < 155.0
    assert answer["states"]["position[x]"]["value"] == pytest.approx(
        200.0, abs=3 * answer["states"]["position[x]"]["sigma"]
    )


def test_44_a_range_that_is_none_is_refused(check: Check, logged: str) -> None:
    for setting, *says in (
        ("{kind: clip_check, stream: fix, columns: [x]}", "nothing says where the sensor clips", "`repeated`"),
        (CLIP.replace("-500 m", "500 m"), "`lowest` is not below `highest`"),
        (CLIP.replace("-500 m", "-500 m/s"), "`lowest` is in m/s, `highest` in m"),
        (
            CLIP.replace("-500 m", "-500 m/s").replace("150 m", "150 m/s"),
            "the column 'x' of stream 'fix' is in m/s here",
        ),
    ):
        found = check(f"{logged}preprocess:\n  clip: {setting}\n")
        assert found.code == 3
        found.says("filter.yaml:", *says)


def test_43_a_frozen_log_is_flagged_and_its_readings_are_not_used(reference: Reference) -> None:
    """A receiver that goes on repeating its last solution, from 40 s to 60 s."""
    log = rows()
    frozen = (log[:, 0] > 40.0) & (log[:, 0] <= 60.0)
    shown, holed = log.copy(), log.copy()
    shown[frozen, 1:], holed[frozen, 1:] = log[79, 1:], np.nan
    answer = reference(shown, STUCK)
    assert events(answer, "stuck") == [("fix", 40.5, 40), ("fix", 40.5, 40)]
    assert "without change for more than 5 s: not used" in told(answer, "stuck")
    assert_as_without(answer, reference(holed))


def test_a_jump_of_a_reference_is_flagged_and_left_out_and_a_heading_may_pass_north(reference: Reference) -> None:
    """x in m here plays a heading that begins anew after 360 m: what counts is the shorter way round."""
    limit = "{kind: jump_limit, stream: fix, columns: [x, y], rate: 5 m/s, tolerance: 10 m}"
    log = rows()
    shown, holed = log.copy(), log.copy()
    shown[100:110, 2], holed[100:110, 2] = shown[100:110, 2] + 200.0, np.nan
    answer = reference(shown, limit)
    assert events(answer, "jump") == [("fix", 50.5, 10)]
    assert_as_without(answer, reference(holed))
    wrapped = log.copy()
    wrapped[:, 1] = (log[:, 1] + 300.0) % 360.0
    assert events(reference(wrapped, limit), "jump")[0][2] > 50
    assert events(reference(wrapped, limit.replace("}", ", period: 360 m}")), "jump") == []


@pytest.mark.parametrize("how", ["no rows", "rows without numbers", "refused by a check"])
def test_35_an_outage_is_told_from_when_until_when_and_the_filter_coasts_and_recovers(
    reference: Reference, how: str
) -> None:
    """600 s of 1300 s without a reference, however that comes about: sigma grows as it must, and comes back."""
    t = np.asarray(1.0 * np.arange(1, 1301), dtype=float)
    log = np.column_stack([t, np.random.default_rng(6).standard_normal((t.size, 2))])
    out = (t > 500.0) & (t <= 1100.0)
    shown, steps = log.copy(), list[str]()
    if how == "no rows":
        shown = log[~out]
    elif how == "rows without numbers":
        shown[out, 1:] = np.nan
    else:
        shown[out, 1:], steps = 1e5, [CLIP, CLIP.replace("[x]", "[y]")]
    answer, whole = reference(shown, *steps), reference(log)
    assert [(e["source"], e["time"]) for e in answer["events"] if e["kind"] == "outage"] == [("fix", 500.0)]
    assert "no usable reading from 500 s to 1101 s, for 601 s: the filter coasts" in told(answer, "outage")
    assert events(whole, "outage") == []
    for label, state in whole["states"].items():
        assert answer["states"][label]["sigma"] == pytest.approx(state["sigma"], rel=1e-3)
        assert abs(answer["states"][label]["value"]) < 4 * state["sigma"]
    assert answer["measurements"]["fix"]["fused"] == 700


def test_35_sigma_grows_through_an_outage_by_the_model_and_by_nothing_else(reference: Reference) -> None:
    """At its end, velocity walks by 0.3 m/s per root s: sigma^2 = s_v^2 + 0.3^2 T, from what it was when the readings ended."""
    t = np.asarray(1.0 * np.arange(1, 701), dtype=float)
    log = np.column_stack([t, np.random.default_rng(6).standard_normal((t.size, 2))])
    log[100:, 1:] = np.nan
    answer, before = reference(log), reference(log[:100])
    assert "no usable reading from 100 s to the end, for 600 s" in told(answer, "outage")
    for axis in ("x", "y"):
        then, now = (a["states"][f"velocity[{axis}]"]["sigma"] for a in (before, answer))
        assert now**2 == pytest.approx(then**2 + 0.09 * 600.0, rel=1e-9)


def arriving(delays: dict[int, float]) -> tuple[Any, list[str]]:
    """Fixes, and the lines of a log of them in the order of their arrival: 20 ms after their instant, some of them later."""
    log = rows(40)
    came = log[:, 0] + 0.02
    for row, delay in delays.items():
        came[row] = log[row, 0] + delay
    order = np.argsort(came)
    table = np.column_stack([log[:, 0], came, log[:, 1:]])[order].tolist()
    return log, [",".join(repr(cell) for cell in row) for row in table]


ARRIVAL = ("--set", "source.streams.fix.arrival=received")


def test_38_rows_that_a_live_filter_would_have_met_too_late_are_not_fused_and_told(
    check: Check, logged: str, folder: Path, reference: Reference
) -> None:
    log, lines = arriving({10: 3.3, 20: 1.2, 30: 0.4})
    (folder / "log.csv").write_text("\n".join(["time,received,x,y", *lines]) + "\n")
    run = ("--json", "--set", "source.streams.fix.file=log.csv", *ARRIVAL)
    answer = json.loads(check(logged, *run, command="run").out)
    assert answer["measurements"]["fix"]["late"] == 2  # the third came before the next one
    assert answer["measurements"]["fix"]["fused"] == 38
    assert events(answer, "late") == [("fix", 5.5, 2)]
    assert "the filter was up to 3 s past the instants of rows that came, not fused" in told(answer, "late")
    assert "late rows sorted" in told(answer, "time order")
    holed = log.copy()
    holed[[10, 20], 1:] = np.nan
    assert_as_without(answer, reference(holed))
    # With a window that reaches far enough the filter is as if all had come in time; with a shorter one it knows one of them.
    whole = json.loads(check(logged, *run, "--set", "estimator.replay=3 s", command="run").out)
    assert events(whole, "replayed") == [("fix", 5.5, 2)]
    assert events(whole, "late") == []
    assert_as_without(whole, reference(log))
    one = json.loads(check(logged, *run, "--set", "estimator.replay=2 s", command="run").out)
    assert (events(one, "late"), events(one, "replayed")) == ([("fix", 5.5, 1)], [("fix", 10.5, 1)])
    holed = log.copy()
    holed[10, 1:] = np.nan
    assert_as_without(one, reference(holed))


def test_38_without_a_column_of_arrival_rows_out_of_order_are_refused_as_before(
    check: Check, logged: str, folder: Path
) -> None:
    _, lines = arriving({10: 3.3})
    (folder / "log.csv").write_text("\n".join(["time,received,x,y", *lines]) + "\n")
    found = check(logged, "--set", "source.streams.fix.file=log.csv", command="run")
    assert found.code == 5
    found.says("time goes backwards", "`time_errors: sort`")


def test_38_an_arrival_that_is_none_is_refused_and_one_before_its_own_instant_told(
    check: Check, logged: str, folder: Path
) -> None:
    _, lines = arriving({})
    text = "\n".join(["time,received,x,y", *lines]) + "\n"
    run = ("--set", "source.streams.fix.file=log.csv")
    (folder / "log.csv").write_text(text.replace("5.0,5.02,", "5.0,,"))
    found = check(logged, *run, *ARRIVAL)
    assert found.code == 5
    found.says("log.csv:11: row 10 does not say when it arrived")
    (folder / "log.csv").write_text(text.replace("5.0,5.02,", "5.0,4.5,"))
    found = check(logged, *run, *ARRIVAL)
    assert found.code == 0
    found.says("rows arrive up to 0.5 s before their own instant", "the clocks do not agree")
    found = check(logged, *run, "--set", "source.streams.fix.arrival=recieved")
    assert found.code == 5
    found.says("recieved")


def test_38_rows_with_an_arrival_pass_checks_and_a_counter_and_no_filter_that_mixes_them(
    check: Check, logged: str, folder: Path
) -> None:
    _, lines = arriving({10: 3.3})
    (folder / "log.csv").write_text("\n".join(["time,received,x,y", *lines]) + "\n")
    run = ("--json", "--set", "source.streams.fix.file=log.csv", *ARRIVAL)
    answer = json.loads(check(f"{logged}preprocess:\n  range: {CLIP}\n  frozen: {STUCK}\n", *run, command="run").out)
    assert events(answer, "late") == [("fix", 5.5, 1)]
    smooth = "{kind: fir_lowpass, stream: fix, into: fix, columns: [x, y], rate: 2 Hz, taps: 5, cutoff: 0.3 Hz}"
    found = check(f"{logged}preprocess:\n  smooth: {smooth}\n", *run, command="run")
    assert found.code == 5
    found.says("the rows of stream 'fix' say when they arrived; they cannot be filtered", "leave `arrival` out")
