"""From a recorded INS and its references, each a file, to a corrected trajectory, at the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimfw.cli.main import main

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
LOG = str(EXAMPLES / "ins_log.yaml")
OWN_UNITS = (
    "source.streams.ins={file: own/ins.txt, separator: ';', time: msec, time_unit: ms, "
    "units: {lat: deg, lon: deg, ve: kn, vn: kn, hdg: deg}}",
    "nominal.columns={latitude: lat, longitude: lon, velocity_E: ve, velocity_N: vn, heading: hdg}",
)


@dataclass(frozen=True)
class Told:
    code: int
    out: str
    err: str


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A working directory with the files of an hour of the simulated voyage in ``drive``."""
    folder = tmp_path_factory.mktemp("voyage")
    config = str(EXAMPLES / "ins_const11_heading.yaml")
    for kind in ("csv", "npz"):
        into = ["--format", kind, "-o", str(folder / "drive"), "--force"]
        assert main(["simulate", config, "--set", "source.duration=1 h", *into]) == 0
    return folder


@pytest.fixture
def run(drive: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Told]:
    """``estimfw run examples/ins_log.yaml ...`` beside the files."""
    monkeypatch.chdir(drive)
    monkeypatch.setenv("COLUMNS", "160")

    def told(*more: str, config: str = LOG) -> Told:
        capsys.readouterr()
        code = main(["run", config, "--no-report", "--set", "estimator.kernel=numba", *more])
        seen = capsys.readouterr()
        return Told(code, seen.out, seen.err)

    return told


@pytest.mark.parametrize("kind", ["csv", "npz"])
def test_the_files_give_what_the_simulation_gave_to_the_last_digit(run: Callable[..., Told], kind: str) -> None:
    longitude = "blocks.longitude_error={kind: ins_errors.longitude_error, sigma: 2.2210284e-6 rad}"
    simulated = str(EXAMPLES / "ins_const11_heading.yaml")
    whole = json.loads(run("--json", "--set", longitude, "--set", "source.duration=1 h", config=simulated).out)
    files = [f"source.streams.{name}.file=drive/{name}.{kind}" for name in ("ins", "velocity", "heading")]
    read = json.loads(run("--json", *(word for one in files for word in ("--set", one))).out)
    for label, state in whole["states"].items():
        for what in ("value", "sigma", "truth", "error"):
            assert read["states"][label][what] == pytest.approx(state[what], rel=1e-12, abs=1e-18), (label, what)
    assert read["corrections"] == whole["corrections"]


@pytest.mark.parametrize("loop", ["open", "closed"])
def test_errors_before_and_after_the_correction_are_told_and_are_what_the_sigmas_say(
    run: Callable[..., Told], loop: str
) -> None:
    told = json.loads(run("--json", "--set", f"estimator.loop={loop}").out)
    assert {one["unit"] for one in told["corrections"].values()} == {"deg", "m/s", "m"}
    for label, one in told["corrections"].items():
        before, after, sigma = one["error_before"], one["error_after"], one["sigma"]
        assert abs(after["end"]) < 4.0 * sigma, label
        assert abs(before["end"]) > 5.0 * sigma and before["rms"] > 5.0 * after["rms"], label
        assert one["correction"] == pytest.approx(before["end"] - after["end"], rel=1e-9)
    recorded = pd.read_csv("drive/ins.csv").iloc[-1]
    with np.load("drive/truth.npz") as truth:
        missed = recorded["latitude"] - truth["latitude"][-1]
    assert told["corrections"]["latitude.corrected"]["error_before"]["end"] == pytest.approx(missed * 6.367e6, rel=2e-3)


def test_the_corrected_trajectory_is_written_in_units_of_its_header_and_as_an_archive(run: Callable[..., Told]) -> None:
    done = run("-o", "first", "--npz")
    assert done.code == 0 and "corrected.csv, corrected.npz" in done.err
    assert "Before and after the correction" in done.out and "rms recorded" in done.out
    table = pd.read_csv("first/corrected.csv")
    ins = pd.read_csv("drive/ins.csv")[1:]
    np.testing.assert_allclose(table["time [s]"], ins["time"])
    np.testing.assert_allclose(table["latitude.corrected recorded [deg]"], np.degrees(ins["latitude"]), rtol=1e-11)
    summary = json.loads(Path("first/summary.json").read_text())
    with np.load("first/corrected.npz") as archive:
        for name, factor, unit in (("latitude.corrected", 180.0 / np.pi, "deg"), ("velocity.N", 1.0, "m/s")):
            np.testing.assert_allclose(table[f"{name} [{unit}]"], archive[name] * factor, rtol=1e-11)
            np.testing.assert_allclose(table[f"{name} sigma [{unit}]"], archive[f"{name}_sigma"] * factor, rtol=1e-11)
            output, _, component = name.partition(".")
            assert archive[name][-1] * factor == pytest.approx(summary[output][component]["value"], rel=1e-12)
    again = run("-o", "first")
    assert again.code == 5 and "--force" in again.err


def test_a_corrected_trajectory_can_be_read_again(run: Callable[..., Told]) -> None:
    """As the reference of another run: its error against itself is nothing."""
    assert run("-o", "reference").code == 0
    columns = "{latitude: 'latitude.corrected [deg]', longitude: 'longitude.corrected [deg]', heading: 'heading.corrected [deg]'}"
    units = "{'latitude.corrected [deg]': deg, 'longitude.corrected [deg]': deg, 'heading.corrected [deg]': deg}"
    truth = f"source.truth={{file: reference/corrected.csv, time: 'time [s]', columns: {columns}, units: {units}}}"
    told = json.loads(run("--json", "--set", truth).out)
    assert told["corrections"]["longitude.corrected"]["error_after"]["rms"] < 1e-4
    assert told["corrections"]["velocity.E"]["error_after"]["rms"] is None


def test_a_log_in_units_and_names_of_its_own(run: Callable[..., Told]) -> None:
    ins = pd.read_csv("drive/ins.csv")
    own = pd.DataFrame({
        "msec": 1e3 * ins["time"], "hdg": np.degrees(ins["heading"]), "lat": np.degrees(ins["latitude"]),
        "lon": np.degrees(ins["longitude"]), "vn": ins["velocity_N"] * 3600 / 1852, "ve": ins["velocity_E"] * 3600 / 1852,
    })  # fmt: skip
    Path("own").mkdir(exist_ok=True)
    own.to_csv("own/ins.txt", sep=";", index=False, float_format="%.17g")
    plain, other = (json.loads(run("--json", *(w for o in more for w in ("--set", o))).out) for more in ((), OWN_UNITS))
    for label, state in plain["states"].items():
        assert other["states"][label]["sigma"] == pytest.approx(state["sigma"], rel=1e-9)
    for label, one in plain["corrections"].items():
        assert other["corrections"][label]["error_after"]["end"] == pytest.approx(
            one["error_after"]["end"], abs=1e-4 * one["sigma"]
        )


def test_a_truth_that_ends_early_counts_as_far_as_it_goes_and_one_of_another_day_is_told(
    run: Callable[..., Told],
) -> None:
    with np.load("drive/truth.npz") as truth:
        time, latitude = truth["t"], truth["latitude"]
    early = time <= 1200.0
    for name, shift in (("early.npz", 0.0), ("other.npz", 86400.0)):
        np.savez(name, t=time[early] + shift, latitude=latitude[early])
    told = json.loads(run("--json", "--set", "source.truth=early.npz").out)["corrections"]
    whole = json.loads(run("--json", "--at", "1200").out)["corrections"]
    assert told["latitude.corrected"] == whole["latitude.corrected"]
    assert told["heading.corrected"]["error_after"] == {"rms": None, "end": None}
    other = json.loads(run("--json", "--set", "source.truth=other.npz").out)
    assert [e["kind"] for e in other["events"] if e["source"] == "truth"] == ["elsewhere"]


def test_without_a_truth_only_the_correction_is_told(run: Callable[..., Told]) -> None:
    told = run("--set", "source.truth=null", "-o", "blind")
    assert "corrected by" in told.out and "No truth is known" in told.out
    answer: Any = json.loads(run("--json", "--set", "source.truth=null").out)
    assert answer["corrections"]["heading.corrected"]["error_before"] == {"rms": None, "end": None}


def test_what_is_wrong_with_a_log_is_told(run: Callable[..., Told]) -> None:
    lines = Path("drive/ins.csv").read_text().splitlines()
    Path("bad").mkdir(exist_ok=True)
    Path("bad/ins.csv").write_text("\n".join([lines[0].replace("heading", "course"), *lines[1:]]))
    missing = run("--json", "--set", "source.streams.ins.file=bad/ins.csv")
    assert missing.code == 5 and "no column 'heading'" in missing.err and "'course'" in missing.err
    unit = run("--json", "--set", "source.streams.ins.units={latitude: m}")
    assert unit.code == 3 and "not in rad" in unit.err
    nowhere = run("--json", "--set", "source.streams.velocity.file=nowhere.csv")
    assert nowhere.code == 5 and "nowhere.csv" in nowhere.err


def test_a_smoother_brings_the_smoothed_trajectory_beside_the_corrected_one(run: Callable[..., Told]) -> None:
    short = [f"source.streams.{name}.stop=600 s" for name in ("ins", "velocity", "heading")]
    smoother = "estimator.smoother={kind: fixed_interval}"
    settings = [word for one in (*short, smoother, "estimator.kernel=numpy") for word in ("--set", one)]
    done = run(*settings, "-o", "smooth", "--npz")
    assert done.code == 0 and "rms smoothed" in done.out
    table = pd.read_csv("smooth/corrected.csv")
    with np.load("smooth/corrected.npz") as archive:
        smoothed, filtered = archive["heading.corrected_smoothed"], archive["heading.corrected"]
        assert np.all(archive["heading.corrected_smoothed_sigma"] <= archive["heading.corrected_sigma"] * (1.0 + 1e-12))
    np.testing.assert_allclose(table["heading.corrected smoothed [deg]"], np.degrees(smoothed), rtol=1e-11)
    assert smoothed[-1] == pytest.approx(filtered[-1], rel=1e-12) and abs(smoothed[0] - filtered[0]) > 1e-6
    heading = json.loads(run(*settings, "--json").out)["corrections"]["heading.corrected"]
    assert heading["error_smoothed"]["rms"] < heading["error_after"]["rms"]


def test_position_errors_are_told_in_metres_at_the_terminal(run: Callable[..., Told]) -> None:
    line = next(one for one in run("-o", "told").out.splitlines() if one.startswith("  latitude.corrected"))
    assert line.count(" m)") == 2 and "′" not in line
