"""`examples/imu_log.yaml`: what a newcomer's log comes to, from files as `estimfw simulate` writes them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from estimfw.cli.main import main

EXAMPLES = Path(__file__).parents[3] / "examples"
CONFIG = str(EXAMPLES / "imu_log.yaml")
SITE = "site={latitude: 34 deg, longitude: 75 deg, height: 100 m}"
PERFECT = ("source.noise=false", "source.gyro_bias=0 deg/h", "source.accel_bias=0 ug", "source.misalignment=0 deg")

Told = tuple[int, str, str]
Estimfw = Callable[..., Told]


@pytest.fixture
def estimfw(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Estimfw:
    """Runs the command line in a folder of its own: exit code, standard output, standard error."""
    monkeypatch.chdir(tmp_path)

    def run(command: str, config: str, *overrides: str, more: tuple[str, ...] = ()) -> Told:
        capsys.readouterr()
        code = main((command, config, *(word for o in overrides for word in ("--set", o)), *more))
        told = capsys.readouterr()
        return code, told.out, told.err

    return run


@pytest.fixture
def simulated(estimfw: Estimfw) -> Callable[..., str]:
    """Writes the log of a vehicle at yaw 30 deg in this format; its path."""

    def make(kind: str, *overrides: str) -> str:
        stands = ("initial_attitude.yaw=30 deg", "initial_attitude.pitch=2 deg", "source.rate=100 Hz")
        code, _, err = estimfw(
            "simulate", str(EXAMPLES / "static_12.yaml"), *stands, *overrides, more=("--format", kind, "-o", kind)
        )
        assert code == 0, err
        return f"{kind}/imu.{kind}"

    return make


def answer(told: Told) -> Any:
    assert told[0] == 0, told[2]
    return json.loads(told[1])


def test_it_asks_for_the_site_with_the_words_to_type(estimfw: Estimfw) -> None:
    code, _, err = estimfw("run", CONFIG)
    assert code == 3
    assert "--set 'site={latitude: ..., longitude: ..., height: ...}'" in err


def test_it_asks_for_the_log(estimfw: Estimfw) -> None:
    code, _, err = estimfw("run", CONFIG, SITE)
    assert code == 5
    assert "my_log.csv: the IMU log does not exist" in err
    assert "give the path of the file in `file`" in err


@pytest.mark.parametrize("kind", ["csv", "npz"])
def test_a_log_that_was_written_is_read_back_to_the_same_attitude(
    kind: str, estimfw: Estimfw, simulated: Callable[..., str]
) -> None:
    log = simulated(kind, *PERFECT, "source.duration=90 s")
    read = answer(estimfw("run", CONFIG, SITE, f"source.file={log}", more=("--json",)))
    settings = ", ".join(o.removeprefix("source.").replace("=", ": ") for o in PERFECT)
    source = f"source={{kind: sins_static.simulate, duration: 90 s, rate: 100 Hz, {settings}}}"
    # The simulation takes its attitude from the start, which is then given and no longer found: the found one is put in.
    start = "initial_attitude={yaw: 30 deg, pitch: 2 deg}"
    given = [answer(estimfw("run", CONFIG, SITE, start, s, more=("--json",))) for s in (source, f"source.file={log}")]
    for angle in ("yaw", "pitch", "roll"):
        values = [a["attitude"][angle]["value"] for a in given]
        assert values[0] == pytest.approx(values[1], abs=1e-9)
        assert read["attitude"][angle]["value"] == pytest.approx(
            {"yaw": 30.0, "pitch": 2.0, "roll": 0.0}[angle], abs=2e-4
        )


def test_a_noisy_log_is_aligned_within_its_sigma(estimfw: Estimfw, simulated: Callable[..., str]) -> None:
    log = simulated("csv", "source.duration=180 s")
    found = answer(estimfw("run", CONFIG, SITE, f"source.file={log}", more=("--json",)))["attitude"]
    for angle, true in (("yaw", 30.0), ("pitch", 2.0), ("roll", 0.0)):
        assert abs(found[angle]["value"] - true) < 3.0 * found[angle]["sigma"]
    assert found["yaw"]["sigma"] < 0.3
