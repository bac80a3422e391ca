"""The worked page for a new nonlinear sensor: its files, installed as a stranger's distribution, do what it says."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

PAGE = (Path(__file__).parents[2] / "docs" / "new_sensor.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^    (estimfw .*)$", PAGE, flags=re.MULTILINE)


@pytest.fixture(scope="module")
def reader(page_files: Callable[[Path], Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The reader's folder with the files of the page; its plugin is installed beside it."""
    folder = page_files(tmp_path_factory.mktemp("reader"))
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index"]
    command += ["--no-deps", "--no-build-isolation", "--target", str(folder.parent / "installed"), "."]
    subprocess.run(command, check=True, capture_output=True, text=True, cwd=folder)
    return folder


def done(reader: Path, *command: str) -> subprocess.CompletedProcess[str]:
    """Of the installed distribution: nothing is taken from the folder itself."""
    inherited = os.environ.get("PYTHONPATH", "")
    path = os.pathsep.join([str(reader.parent / "installed"), *([inherited] if inherited else [])])
    environment = os.environ | {"PYTHONPATH": path, "PYTHONSAFEPATH": "1"}
    return subprocess.run(
        [sys.executable, *command], capture_output=True, text=True, env=environment, cwd=reader, check=False
    )


def told(reader: Path, command: str) -> str:
    """What a command of the page prints."""
    ran = done(reader, "-m", "estimfw.cli.main", *shlex.split(command)[1:])
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def test_the_page_names_its_files_and_commands() -> None:
    assert len(re.findall(r"^# range_beacon/\w+\.py$", PAGE, flags=re.MULTILINE)) == 5
    assert [c.split()[1] for c in COMMANDS] == ["plugins", "explain", "run", "run", "run"]


def test_installed_plugin_is_found_with_all_that_it_brings(reader: Path) -> None:
    shown = told(reader, COMMANDS[0])
    for kind in ("beacon.dead_reckoning", "beacon.position_error", "beacon.range", "beacon.boat"):
        assert kind in shown


def test_explain_names_the_derived_variables_that_keep_it_from_being_time_invariant(reader: Path) -> None:
    assert "measurement pier needs pier_direction, which is varying" in told(reader, COMMANDS[1])


def test_the_extended_filter_finds_the_boat(reader: Path) -> None:
    told(reader, f"{COMMANDS[2]} --no-report")
    result = xr.load_dataset(reader / "results" / "boat" / "result.nc", engine="h5netcdf")
    end = result.isel(time=-1)
    assert np.all(np.abs(end["output_error"]) < 4.0 * end["output_sigma"])
    assert float(end["output_sigma"][0]) < 0.5, "sigma was 30 m at the start"
    assert all(0.7 < float(result[f"{name}_nis"].mean()) < 1.4 for name in ("pier", "rock", "tower"))
    assert json.loads(result.attrs["provenance"])["kernel"] == "numba"


def test_the_unscented_filter_agrees_where_ranges_hardly_bend(reader: Path) -> None:
    told(reader, f"{COMMANDS[3]} --no-report --set 'source.duration=20 s'")
    told(reader, f"{COMMANDS[2]} --no-report --force --set 'source.duration=20 s'")
    ends = [
        xr.load_dataset(reader / "results" / name / "result.nc", engine="h5netcdf").isel(time=-1)
        for name in ("boat", "unscented")
    ]
    sigma = ends[0]["output_sigma"].to_numpy()
    assert np.all(np.abs(ends[0]["output_value"] - ends[1]["output_value"]) < 0.2 * sigma)
    np.testing.assert_allclose(ends[1]["output_sigma"], sigma, rtol=0.05)


def test_a_bank_finds_a_boat_that_is_not_where_the_config_says(reader: Path) -> None:
    printed = told(reader, f"{COMMANDS[4]} --no-report --set 'source.duration=20 s'")
    assert "bank of 5: position[N] -200 m, weight 0.9" in printed
    end = xr.load_dataset(reader / "results" / "bank" / "result.nc", engine="h5netcdf").isel(time=-1)
    assert np.all(np.abs(end["output_error"]) < 4.0 * end["output_sigma"])


def test_the_plugins_own_test_passes(reader: Path) -> None:
    ran = done(reader, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_range_beacon.py")
    assert ran.returncode == 0, ran.stdout
    assert "1 passed" in ran.stdout


def test_a_wrong_sign_in_h_is_found_and_named(reader: Path) -> None:
    code = (
        "from range_beacon import range_to; from estimfw import open_filter\n"
        "from estimfw.testing import check_jacobians\n"
        "right = range_to.direction\n"
        "range_to.direction = lambda position_n, beacon: -right(position_n, beacon)\n"
        "check_jacobians(open_filter('boat.yaml'))"
    )
    ran = done(reader, "-c", code)
    assert ran.returncode == 1
    assert "pier[range]: H over position_error[N] is 0.948496" in ran.stderr
