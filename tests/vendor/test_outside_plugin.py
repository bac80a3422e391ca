"""A vendor's plugin, installed from outside the repository, adds a sensor; no file of the framework knows of it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
NOISE = 0.005
BASELINE = 1.2


@pytest.fixture(scope="module")
def vendor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plugin, copied out of the repository and installed into a folder of its own."""
    there = tmp_path_factory.mktemp("acme")
    copy = shutil.copytree(ROOT / "examples" / "vendor_sensor", there / "compass")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index"]
    command += ["--no-deps", "--no-build-isolation", "--target", str(there / "installed"), str(copy)]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return there / "installed"


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The static example with 10 readings of the compass, drawn around the true baseline of a vehicle at yaw 30 deg."""
    there = tmp_path_factory.mktemp("user")
    time = np.arange(60.0, 601.0, 60.0)
    yaw = np.deg2rad(30.0)
    truth = BASELINE * np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    readings = truth + NOISE * np.random.default_rng(4).standard_normal((time.size, 3))
    rows = "\n".join(",".join(f"{x:.9f}" for x in (t, *r)) for t, r in zip(time, readings, strict=True))
    (there / "compass.csv").write_text(f"time,E,N,U\n{rows}\n")
    text = (ROOT / "examples" / "static_12.yaml").read_text().replace("yaw: 0 deg", "yaw: 30 deg")
    compass = f"  compass: {{kind: acme.baseline, antennas: [0 m, {BASELINE} m, 0 m], noise: 5 mm}}\n"
    text = text.replace("policies:\n", f"{compass}policies:\n", 1)
    text += "aiding:\n  compass: {kind: acme.compass_log, file: compass.csv}\n"
    (there / "aided.yaml").write_text(text)
    return there / "aided.yaml"


def estimfw(*arguments: str, vendor: Path | None, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    if vendor is not None:
        environment["PYTHONPATH"] = str(vendor)
    command = [sys.executable, "-m", "estimfw.cli.main", *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment, cwd=cwd, check=False)


def test_installed_plugin_is_listed_with_its_distribution_and_components(vendor: Path, config: Path) -> None:
    listed = json.loads(estimfw("plugins", "list", "--json", vendor=vendor, cwd=config.parent).stdout)["plugins"]
    acme = next(p for p in listed if p["name"] == "acme")
    assert (acme["distribution"], acme["version"], acme["status"]) == ("acme-compass", "1.0.0", "loaded")
    shown = estimfw("plugins", "show", "acme", vendor=vendor, cwd=config.parent).stdout
    assert "acme.baseline" in shown
    assert "acme.compass_log" in shown


def test_compass_aids_the_alignment_as_the_information_it_brings(vendor: Path, config: Path) -> None:
    plain = estimfw("run", str(ROOT / "examples" / "static_12.yaml"), "--json", vendor=vendor, cwd=config.parent)
    done = estimfw("run", str(config), "--json", vendor=vendor, cwd=config.parent)
    assert done.returncode == 0, done.stderr
    aided = json.loads(done.stdout)
    alone = json.loads(plain.stdout)["attitude"]["yaw"]["sigma"]
    compass = np.rad2deg(NOISE / BASELINE / np.sqrt(10.0))
    expected = 1.0 / np.hypot(1.0 / alone, 1.0 / compass)
    # The ten readings determine the yaw to 0.075 deg, the gyros to 0.056; the parts of phi_U that they share
    # with the other states make the sum of information a bound that is nearly reached.
    assert aided["attitude"]["yaw"]["sigma"] == pytest.approx(expected, rel=0.05)
    assert abs(aided["attitude"]["yaw"]["value"] - 30.0) < 3.0 * aided["attitude"]["yaw"]["sigma"] + 0.03
    assert aided["measurements"]["compass"]["fused"] == 10


def test_without_the_plugin_its_kind_is_refused_by_name(config: Path) -> None:
    done = estimfw("check", str(config), vendor=None, cwd=config.parent)
    assert done.returncode == 3
    assert "acme.compass_log" in done.stderr
    assert "no plugin 'acme' is installed" in done.stderr
    assert "aided.yaml:" in done.stderr


def test_vendors_own_tests_can_use_the_conformance_kit(vendor: Path, config: Path) -> None:
    code = (
        "from estimfw import open_filter; from estimfw.testing import check_measurements\n"
        "still = ['source.misalignment=[0 deg, 0 deg, 0 deg]', 'policies=[]', 'source.accel_bias=0 ug']\n"
        f"check_measurements(open_filter({config.name!r}, still), tolerance=1e-4)"
    )
    environment = os.environ | {"PYTHONPATH": str(vendor)}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=config.parent, check=False)
    assert done.returncode == 0, done.stderr


def test_vendors_own_error_is_placed_in_the_config(vendor: Path, config: Path) -> None:
    done = estimfw("run", str(config), "--set", "aiding.compass.file=gone.csv", vendor=vendor, cwd=config.parent)
    assert done.returncode == 5
    assert "gone.csv" in done.stderr


def test_vendors_settings_are_in_the_schema(vendor: Path, config: Path) -> None:
    schema = json.loads(estimfw("schema", vendor=vendor, cwd=config.parent).stdout)
    assert "measurement:acme.baseline" in schema["$defs"]
    assert schema["$defs"]["measurement:acme.baseline"]["properties"]["antennas"]
