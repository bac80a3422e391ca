"""``estimfw run --json``, ``--at`` and ``--csv`` on the static experiment: what others read from the program."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.cli.main import main
from estimfw.errors import UsageError
from estimfw.run.dataset import result_dataset
from estimfw.run.until import until
from estimfw.run.values_file import values_csv

EXAMPLES = Path(__file__).parents[3] / "examples"
SHORT = "source.duration=60 s"
SHOWN = ("", " sigma", " honest sigma")


@pytest.fixture
def run_json(capsys: pytest.CaptureFixture[str]) -> Callable[..., dict[str, Any]]:
    """The answer of ``estimfw run EXAMPLE --json``: standard output is one JSON value and nothing else."""

    def call(example: str, *arguments: str) -> dict[str, Any]:
        capsys.readouterr()
        assert main(["run", str(EXAMPLES / f"{example}.yaml"), "--json", *arguments]) == 0
        found = json.loads(capsys.readouterr().out)
        assert isinstance(found, dict)
        return found

    return call


def wrapped(angle: float) -> float:
    """-180 to 180 deg."""
    return (angle + 180.0) % 360.0 - 180.0


def settings(*overrides: str) -> list[str]:
    return [word for text in overrides for word in ("--set", text)]


def test_answer_has_time_states_attitude_dispositions_and_nis(run_json: Callable[..., dict[str, Any]]) -> None:
    found = run_json("static_12", *settings(SHORT))
    assert found["time"] == 60.0
    units = {"velocity_error": "m/s", "attitude_error": "rad", "accel_bias": "m/s^2", "gyro_bias": "rad/s"}
    axes = {"velocity_error": "ENU", "attitude_error": "ENU", "accel_bias": "RFU", "gyro_bias": "RFU"}
    assert list(found["states"]) == [f"{block}[{a}]" for block in units for a in axes[block]]
    for label, state in found["states"].items():
        assert set(state) == {"value", "sigma", "honest_sigma", "unit", "truth", "error"}
        assert state["unit"] == units[label.partition("[")[0]]
        assert state["sigma"] > 0.0
        assert state["error"] == pytest.approx(state["value"] - state["truth"], abs=1e-12)
    assert list(found["attitude"]) == ["yaw", "pitch", "roll", "heading"]
    for angle in found["attitude"].values():
        assert set(angle) == {"value", "sigma", "honest_sigma", "unit", "truth", "error"}
        assert angle["unit"] == "deg"
    assert found["dispositions"] == {"fused": 60, "gated": 0, "late": 0, "missing": 0, "invalid": 0}
    assert 0.0 < found["mean_nis"] < 0.1


def test_true_states_are_those_of_the_simulation(run_json: Callable[..., dict[str, Any]]) -> None:
    states = run_json("static_12", *settings(SHORT, "source.accel_bias=[120 ug, -80 ug, 50 ug]"))["states"]
    for axis, bias in zip("RFU", (120.0, -80.0, 50.0), strict=True):
        assert states[f"accel_bias[{axis}]"]["truth"] == pytest.approx(bias * 9.80665e-6)
        assert states[f"gyro_bias[{axis}]"]["truth"] == pytest.approx(np.radians(0.01) / 3600.0)
    for axis in "ENU":
        assert states[f"attitude_error[{axis}]"]["truth"] == pytest.approx(np.radians(1.0), rel=0.01)


def test_biases_in_n_have_their_truth_in_n(run_json: Callable[..., dict[str, Any]]) -> None:
    overrides = (SHORT, "initial_attitude.yaw=90 deg", "source.gyro_bias=[0.01 deg/h, 0.02 deg/h, 0.03 deg/h]")
    states = run_json("static_7", *settings(*overrides))["states"]
    # With the nose to the west, the right side looks north.
    assert states["gyro_bias[N]"]["truth"] == pytest.approx(np.radians(0.01) / 3600.0)
    assert states["gyro_bias[U]"]["truth"] == pytest.approx(np.radians(0.03) / 3600.0)


@pytest.mark.parametrize(
    ("given", "yaw", "heading"),
    [(0.0, 0.0, 0.0), (-92.0, -92.0, 92.0), (120.0, 120.0, 240.0), (200.0, -160.0, 160.0), (180.0, 180.0, 180.0)],
)
def test_yaw_is_counter_clockwise_within_180_and_heading_clockwise_from_0_to_360(
    given: float, yaw: float, heading: float, run_json: Callable[..., dict[str, Any]]
) -> None:
    overrides = ("source.duration=5 s", "source.misalignment=0 deg", f"initial_attitude.yaw={given} deg")
    attitude = run_json("static_7", *settings(*overrides))["attitude"]
    assert wrapped(attitude["yaw"]["truth"] - yaw) == pytest.approx(0.0, abs=1e-9)
    assert attitude["heading"]["truth"] == pytest.approx(heading, abs=1e-9)
    assert -180.0 <= attitude["yaw"]["value"] <= 180.0
    assert 0.0 <= attitude["heading"]["value"] < 360.0
    assert wrapped(attitude["yaw"]["value"] + attitude["heading"]["value"]) == pytest.approx(0.0, abs=1e-9)
    assert attitude["yaw"]["sigma"] == attitude["heading"]["sigma"]
    for angle in (attitude["yaw"], attitude["heading"]):
        assert abs(angle["error"]) < 0.01  # wrapped: 359.999 deg misses 0 deg by -0.001


def test_sigma_of_a_level_attitude_is_that_of_its_error_states(run_json: Callable[..., dict[str, Any]]) -> None:
    found = run_json("static_12", *settings("source.misalignment=0 deg"))
    for angle, axis in (("pitch", "E"), ("roll", "N"), ("yaw", "U")):
        sigma = np.degrees(found["states"][f"attitude_error[{axis}]"]["sigma"])
        assert found["attitude"][angle]["sigma"] == pytest.approx(sigma, rel=1e-3)


def test_sigma_of_attitude_follows_finite_differences_on_a_tilted_base(ran: Callable[..., Any]) -> None:
    from scipy.spatial.transform import Rotation

    angles = ("initial_attitude.yaw=40 deg", "initial_attitude.pitch=30 deg", "initial_attitude.roll=-50 deg")
    done = ran("static_12", SHORT, "source.misalignment=0 deg", "source.noise=false", *angles)
    C_bn = Rotation.from_euler("ZXY", (40.0, 30.0, -50.0), degrees=True)

    def ypr(phi: Any) -> Any:
        return (Rotation.from_rotvec(phi) * C_bn).as_euler("ZXY")

    step = 1e-6
    J = np.stack([(ypr(step * e) - ypr(-step * e)) / (2.0 * step) for e in np.eye(3)], axis=1)
    P = done.covariance[-1][3:6, 3:6]
    np.testing.assert_allclose(done.output_sigma[-1, :3], np.sqrt(np.diag(J @ P @ J.T)), rtol=1e-3)


def test_at_answers_for_that_instant(run_json: Callable[..., dict[str, Any]]) -> None:
    early = run_json("static_7", *settings(SHORT, "source.noise=false"), "--at", "30")
    alone = run_json("static_7", *settings("source.duration=30 s", "source.noise=false"))
    assert early["time"] == 30.0
    assert early["states"] == alone["states"]
    assert early["attitude"] == alone["attitude"]


@pytest.mark.parametrize("at", [-5.0, 900.0])
def test_at_outside_the_run_is_a_fault_of_usage(at: float, ran: Callable[..., Any]) -> None:
    with pytest.raises(UsageError, match=r"outside the run\s+the run goes from 1 to 60 s"):
        until(result_dataset(ran("static_7", SHORT)), at)


def test_attitude_over_time_as_csv(tmp_path: Path, run_json: Callable[..., dict[str, Any]]) -> None:
    folder = tmp_path / "result"
    last = run_json("static_7", *settings(SHORT), "--output", str(folder), "--csv", "--no-report")
    with (folder / "outputs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 60
    names = ["yaw", "pitch", "roll", "heading"]
    assert list(rows[0]) == ["time [s]", *(f"attitude.{n}{what} [deg]" for n in names for what in SHOWN)]
    assert [float(r["time [s]"]) for r in rows] == list(range(1, 61))
    for name in names:
        assert float(rows[-1][f"attitude.{name} [deg]"]) == pytest.approx(last["attitude"][name]["value"])
        assert float(rows[-1][f"attitude.{name} sigma [deg]"]) == pytest.approx(last["attitude"][name]["sigma"])
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["attitude"] == last["attitude"]


def test_csv_of_a_result_has_the_angles_in_deg(ran: Callable[..., Any]) -> None:
    done = ran("static_7", SHORT, "initial_attitude.yaw=-92 deg")
    lines = values_csv(result_dataset(done)).splitlines()
    assert float(lines[-1].split(",")[1]) == pytest.approx(np.degrees(done.output[-1, 0]), abs=1e-9)
