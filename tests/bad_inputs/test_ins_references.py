"""References of a recorded INS that go bad (33, 35, 38, 43, 44, 45, 46, 52): flagged, survived, nothing silent.

A ship on a northerly course, so that its headings go through North; two hours, all from files. "Survived" is always the same
claim: every estimate stays within 4.5 of its sigmas of the truth, and no sigma is more than a little larger than on the good log.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.cli.main import main

FloatArray = NDArray[np.float64]
Command = Callable[..., Any]
Voyage = Callable[..., Any]
EXAMPLES = Path(__file__).parents[2] / "examples"
SETTINGS = """
estimator: {kind: kalman, loop: closed, gate: 0.99999, kernel: numba, discretisation: {evaluation: start}}
"""
DEGREE = np.pi / 180.0
Logs = dict[str, FloatArray]
CLEAN: dict[Path, dict[str, Any]] = {}
HEADERS = {"velocity": "time,E,N", "heading": "time,heading"}


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Logs]:
    """A folder with the files of the voyage, and its references as arrays."""
    there = tmp_path_factory.mktemp("voyage")
    for file in ("ins_6.yaml", "ins_const11.yaml", "ins_const11_heading.yaml", "ins_log.yaml"):
        shutil.copy(EXAMPLES / file, there)
    simulate = ("simulate", str(there / "ins_const11_heading.yaml"), "--format", "csv", "-o", str(there / "drive"))
    assert main([*simulate, "--set", "source.duration=2 h", "--set", "source.course=0 deg"]) == 0
    logs = {
        name: np.loadtxt(there / "drive" / f"{name}.csv", delimiter=",", skiprows=1) for name in ("velocity", "heading")
    }
    assert np.ptp(logs["heading"][:, 1]) > 6.0  # through North
    return there, logs


@pytest.fixture
def voyage(good: tuple[Path, Logs], check: Command, folder: Path) -> Voyage:
    """The answer of a run on these references, with further lines of config."""
    there, logs = good

    def run(changed: Logs, more: str = "", *settings: str, code: int = 0, columns: str = "") -> Any:
        for file in there.glob("*.yaml"):
            shutil.copy(file, folder)
        (folder / "drive").mkdir(exist_ok=True)
        for part in ("ins.csv", "truth.npz"):
            shutil.copy(there / "drive" / part, folder / "drive")
        for name, log in (logs | changed).items():
            extra = columns if log.shape[1] > logs[name].shape[1] else ""
            lines = [",".join("" if np.isnan(c) else repr(c) for c in row) for row in log.tolist()]
            (folder / "drive" / f"{name}.csv").write_text("\n".join([HEADERS[name] + extra, *lines]) + "\n")
        words = [w for s in settings for w in ("--set", s)]
        told = check("estimfw: 1\nextends: ins_log.yaml\n" + SETTINGS + more, "--json", *words, command="run")
        assert told.code == code, told.err + told.out
        return json.loads(told.out) if code == 0 else told

    return run


@pytest.fixture
def clean(voyage: Voyage, good: tuple[Path, Logs]) -> dict[str, Any]:
    """The answer on the good log."""
    if good[0] not in CLEAN:
        CLEAN[good[0]] = voyage({})
    return CLEAN[good[0]]


def events(answer: dict[str, Any], kind: str) -> list[tuple[str, float, int]]:
    return [(e["source"], e["time"], e["count"]) for e in answer["events"] if e["kind"] == kind]


def assert_survived(answer: dict[str, Any], clean: dict[str, Any], wider: float = 1.05) -> None:
    """See the module."""
    for label, state in answer["states"].items():
        like = clean["states"][label]
        assert state["sigma"] < wider * like["sigma"], label
        assert abs(state["error"]) < 4.5 * state["sigma"], label
    for name, axis in (("heading", "corrected"), ("velocity", "E"), ("velocity", "N"), ("latitude", "corrected")):
        output = answer[name][axis]
        assert abs(output["error"]) < 4.5 * output["sigma"], name
    assert answer["cautions"] == clean["cautions"] == []


def changed(log: FloatArray, rows: Any, column: int | slice, change: Callable[[FloatArray], Any]) -> FloatArray:
    made = log.copy()
    made[rows, column] = change(made[rows, column])
    return made


def test_the_good_log_is_good(clean: dict[str, Any]) -> None:
    assert clean["events"] == []
    assert clean["dispositions"]["fused"] == 1440
    assert_survived(clean, clean)


def test_45_outliers_are_gated_one_by_one(voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]) -> None:
    rows = np.random.default_rng(3).choice(np.arange(20, 720), 14, replace=False)
    logs = {
        "velocity": changed(good[1]["velocity"], rows, 1, lambda v: v + 4.0),
        "heading": changed(good[1]["heading"], rows, 1, lambda k: np.mod(k + 350.0 * DEGREE, 2.0 * np.pi)),
    }
    answer = voyage(logs)
    first = 10.0 * (float(rows.min()) + 1.0)
    assert events(answer, "gated") == [("velocity", first, 14), ("heading", first, 14)]
    assert events(answer, "health degraded") == events(answer, "divergence") == []
    assert_survived(answer, clean)


JUMPS = """
preprocess:
  gnss: {kind: jump_limit, stream: velocity, columns: [E, N], rate: 0.05 m/s^2, tolerance: 0.4 m/s, longest: 1200 s}
  yaw: {kind: jump_limit, stream: heading, columns: [heading], rate: 0.1 deg/s, tolerance: 1 deg, period: 360 deg, longest: 1 h}
"""


def test_a_jump_and_a_jump_back_are_left_out_and_passing_north_is_none(
    voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]
) -> None:
    assert [e["kind"] for e in voyage({}, JUMPS)["events"]] == []
    jumped = slice(300, 360)
    logs = {
        "velocity": changed(good[1]["velocity"], jumped, 1, lambda v: v + 1.5),
        "heading": changed(good[1]["heading"], jumped, 1, lambda k: np.mod(k + 25.0 * DEGREE, 2.0 * np.pi)),
    }
    answer = voyage(logs, JUMPS, "estimator.gate=null")
    assert events(answer, "jump") == [("velocity", 3010.0, 60), ("heading", 3010.0, 60)]
    assert_survived(answer, clean, wider=1.3)


def test_46_a_compass_that_is_off_for_good_is_told_and_the_rest_goes_on(
    voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]
) -> None:
    logs = {
        "heading": changed(good[1]["heading"], slice(400, None), 1, lambda k: np.mod(k + 10.0 * DEGREE, 2.0 * np.pi))
    }
    answer = voyage(logs)
    assert events(answer, "health degraded") == [("heading", 4010.0, 320)]
    assert answer["measurements"]["heading"]["fused"] == 400
    (caution,) = answer["cautions"]
    assert "heading was rejected each of the 320 times it was due from 4010 s to 7200 s" in caution
    assert abs(answer["heading"]["corrected"]["error"]) < 4.5 * answer["heading"]["corrected"]["sigma"]
    told = voyage(logs, "health: {rejected: {longer: 10 min, then: stop}}\n", code=6)
    told.says("heading was rejected 61 times in a row, up to step 461 (t = 4610 s)", "last good before 4010 s")


def test_52_a_reference_that_is_far_noisier_than_the_config_says_is_divergence(
    voyage: Voyage, good: tuple[Path, Logs]
) -> None:
    noise = 0.25 * np.random.default_rng(1).standard_normal((320, 2))
    noisy = good[1]["velocity"].copy()
    noisy[400:, 1:] += noise
    answer = voyage({"velocity": noisy}, "health: {}\n", "estimator.gate=null")
    ((source, since, _),) = events(answer, "divergence")
    assert source == "velocity"
    assert 4010.0 <= since <= 4100.0
    assert any("mean NIS of velocity" in caution for caution in answer["cautions"])
    told = voyage({"velocity": noisy}, "health: {divergence: {strict: true}}\n", "estimator.gate=null", code=6)
    told.says("the filter diverged at step 40", "the mean NIS of velocity", "within bounds last at 40")


STUCK = """
preprocess:
  frozen: {kind: stuck, stream: velocity, columns: [E, N], longest: 30 s}
  stopped: {kind: stuck, stream: heading, columns: [heading], longest: 30 s, rest: null}
"""


def test_43_a_frozen_log_is_flagged_and_not_used(
    voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]
) -> None:
    frozen = slice(200, 300)
    logs = {name: changed(log, frozen, slice(1, None), lambda x: x[0]) for name, log in good[1].items()}
    answer = voyage(logs, STUCK)
    assert events(answer, "stuck") == [("velocity", 2020.0, 99), ("velocity", 2020.0, 99), ("heading", 2020.0, 99)]
    assert events(answer, "outage") == [("velocity", 2010.0, 1), ("heading", 2010.0, 1)]
    assert_survived(answer, clean, wider=1.3)


def test_33_a_component_without_a_number_is_skipped_and_the_other_fused(
    voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]
) -> None:
    answer = voyage({"velocity": changed(good[1]["velocity"], slice(100, 200, 3), 1, lambda v: v * np.nan)})
    assert events(answer, "missing") == [("velocity", 1010.0, 34)]
    assert answer["measurements"]["velocity"]["fused"] == 720
    assert_survived(answer, clean)


def test_44_a_clipped_speed_is_flagged_and_not_used(
    voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]
) -> None:
    """A log that shows no more than the ship makes on the mean: half of its readings to the north are at the end of its range."""
    top = float(np.median(good[1]["velocity"][:, 2]))
    clipped = int(np.count_nonzero(good[1]["velocity"][:, 2] >= top))
    check = f"preprocess: {{range: {{kind: clip_check, stream: velocity, columns: [N], highest: {top!r} m/s}}}}\n"
    answer = voyage({"velocity": changed(good[1]["velocity"], slice(None), 2, lambda v: np.minimum(v, top))}, check)
    ((source, _, count),) = events(answer, "clipped")
    assert (source, count) == ("velocity", clipped)
    assert answer["measurements"]["velocity"]["fused"] == 720


def test_38_late_and_reordered_messages_are_fused_at_their_own_time_or_not_at_all(
    voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]
) -> None:
    """One message in five is up to 100 s late; the INS itself is always in time."""
    rng, logs = np.random.default_rng(5), {}
    for name, log in good[1].items():
        late = np.where(rng.random(len(log)) < 0.2, 100.0 * rng.random(len(log)), 0.0)
        came = np.column_stack([log, log[:, 0] + 0.5 * rng.random(len(log)) + late])
        logs[name] = came[np.argsort(came[:, -1])]
    arrival = tuple(f"source.streams.{name}.arrival=received" for name in logs)
    within = voyage(logs, "", *arrival, "estimator.replay=100.5 s", columns=",received")
    assert {kind for kind, *_ in ((e["kind"], e) for e in within["events"])} == {"replayed", "time order"}
    for label, state in clean["states"].items():
        assert within["states"][label]["value"] == pytest.approx(state["value"], rel=1e-9, abs=1e-15)
    none = voyage(logs, "", *arrival, columns=",received")
    assert none["measurements"]["velocity"]["late"] + none["measurements"]["velocity"]["fused"] == 720
    assert none["measurements"]["velocity"]["late"] > 500  # each came after the INS row of its own instant
    some = voyage(logs, "", *arrival, "estimator.replay=10 s", columns=",received")
    assert 80 < some["measurements"]["velocity"]["late"] < 160
    assert_survived(some, clean, wider=1.2)


def test_35_an_outage_of_ten_minutes_is_told_and_the_estimate_recovers(
    voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]
) -> None:
    time = good[1]["velocity"][:, 0]
    there = (time <= 5400.0) | (time > 6000.0)
    logs = {name: log[there] for name, log in good[1].items()}
    answer = voyage(logs)
    assert events(answer, "outage") == [("velocity", 5400.0, 1), ("heading", 5400.0, 1)]
    text = next(e["text"] for e in answer["events"] if e["kind"] == "outage")
    assert text == "no usable reading from 5400 s to 6010 s, for 610 s: the filter coasts"
    assert_survived(answer, clean, wider=1.6)
    cut = {name: log[log[:, 0] <= 5400.0] for name, log in good[1].items()}
    blind = voyage(cut, "", "source.streams.ins.stop=6000 s")
    at = voyage(cut, "", "source.streams.ins.stop=5400 s")
    for axis in ("E", "N"):
        assert blind["velocity"][axis]["sigma"] > 1.5 * at["velocity"][axis]["sigma"]
        assert abs(blind["velocity"][axis]["error"]) < 4.5 * blind["velocity"][axis]["sigma"]


def test_all_of_it_in_one_voyage(voyage: Voyage, good: tuple[Path, Logs], clean: dict[str, Any]) -> None:
    velocity, heading = good[1]["velocity"].copy(), good[1]["heading"].copy()
    velocity[50, 1] += 30.0
    velocity[100:110, 2] = np.nan
    velocity[200:240, 1:] = velocity[200, 1:]
    heading[300:330, 1] = np.mod(heading[300:330, 1] + 40.0 * DEGREE, 2.0 * np.pi)
    there = (velocity[:, 0] <= 4500.0) | (velocity[:, 0] > 5100.0)
    answer = voyage({"velocity": velocity[there], "heading": heading}, STUCK + JUMPS.replace("preprocess:\n", ""))
    found = {(e["source"], e["kind"]) for e in answer["events"]}
    kinds = {"velocity": ("jump", "missing", "stuck", "outage"), "heading": ("jump", "missing", "outage")}
    assert found == {(source, kind) for source, own in kinds.items() for kind in own}
    assert_survived(answer, clean, wider=1.6)
