"""``check``, ``explain``, ``simulate``, ``schema`` and ``plugins``: for people at any width, and for machines."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.cli.main import main

Run = Callable[..., Any]
TRACKER = "examples/tracker.yaml"


def test_check_does_everything_but_the_run(estimfw: Run) -> None:
    told = estimfw("check", TRACKER)
    assert told.code == 0
    assert told.out.startswith("ok: 4 states, ")
    assert not list(Path().iterdir())
    found = json.loads(estimfw("check", TRACKER, "--json").out)
    assert found["ok"] and found["kernel"] == "numpy" and len(found["states"]) == 4


def test_check_without_data_needs_no_record(estimfw: Run) -> None:
    assert estimfw("check", "examples/lasergyro_12.yaml", "--no-data").code == 0
    told = estimfw("check", "examples/lasergyro_12.yaml", "--json")
    assert told.code == 5
    assert json.loads(told.out)["error"]["kind"] == "data"


@pytest.mark.parametrize("width", [80, 200])
def test_explain_fits_the_terminal_and_breaks_no_word(estimfw: Run, width: int) -> None:
    from io import StringIO

    from rich.console import Console

    from estimfw.report.explain_text import explanation
    from estimfw.run.from_python import open_filter

    problem = open_filter(Path(__file__).resolve().parents[2] / "examples" / "static_7.yaml")
    out = Console(file=StringIO(), width=width)
    for part in explanation(problem):
        out.print(part)
    assert isinstance(out.file, StringIO)
    text = out.file.getvalue()
    assert "…" not in text
    assert all(len(line) <= width for line in text.splitlines())
    words = set(text.split())
    assert {
        "attitude_error[U]",
        "sins_static.prune_unobservable",
        "gyro_bias_coupling",
        "approximate",
        "time-invariant:",
    } <= words


def test_explain_shows_the_assembled_equations_of_the_paper(estimfw: Run) -> None:
    out = estimfw("explain", "examples/static_7.yaml", width=200).out
    lines = [" ".join(line.split()) for line in out.splitlines()]
    # eq. (16) of the paper, its corrected signs: dVE' = -g phiN, dVN' = g phiE, phiE' = wU phiN - wN phiU ...
    for equation in (
        "d/dt velocity_error[E] = -gravity attitude_error[N] + accel_noise[E]",
        "d/dt velocity_error[N] = gravity attitude_error[E] + accel_noise[N]",
        "d/dt gyro_bias[U] = 0",
        "zero_velocity[N] = velocity_error[N] + noise",
    ):
        assert equation in lines
    assert "earth_rate_n[U] attitude_error[N] - earth_rate_n[N] attitude_error[U] - gyro_noise[E]" in " ".join(lines)


def test_explain_says_what_each_policy_removed_and_why(estimfw: Run) -> None:
    out = " ".join(estimfw("explain", "examples/static_7.yaml").out.split())
    assert (
        "sins_static.prune_unobservable approximate 10 -> 7 states removes accel_bias[E], accel_bias[N], gyro_bias[E]"
        in out
    )
    assert "sins_static.prune_unobservable 7 7" in out
    assert "as configured 12 9" in out


def test_explain_names_rotations_by_the_axes_of_their_frames(estimfw: Run) -> None:
    out = " ".join(estimfw("explain", "examples/lasergyro_12.yaml").out.split())
    assert "C_bn[E,R] accel_bias[R] + C_bn[E,F] accel_bias[F]" in out
    assert "- C_bn[U,U] gyro_bias[U]" in out


def test_explain_for_machines_and_for_papers(estimfw: Run) -> None:
    found = json.loads(estimfw("explain", TRACKER, "--json").out)
    assert np.shape(found["F"]) == (4, 4)
    assert r"\begin{align*}" in estimfw("explain", TRACKER, "--latex").out


def test_simulate_writes_the_record_and_refuses_to_replace_it(estimfw: Run) -> None:
    told = estimfw("simulate", TRACKER, "-o", "record", "--json")
    files = json.loads(told.out)["files"]
    assert files and all(Path(file).is_file() for file in files)
    again = estimfw("simulate", TRACKER, "-o", "record")
    assert again.code == 5 and "--force" in again.err
    assert estimfw("simulate", TRACKER, "-o", "record", "--force").out.splitlines() == files


def test_schema_is_json_and_tells_as_json_what_it_wrote(estimfw: Run) -> None:
    assert json.loads(estimfw("schema").out) == json.loads(estimfw("schema", "--json").out)
    told = estimfw("schema", "--write", "schemas", "--json")
    assert json.loads(told.out) == {"ok": True, "files": [str(Path("schemas/filter.schema.json"))]}
    assert json.loads(estimfw("schema", "--check", "schemas", "--json").out)["ok"]


NO_SOURCE = """estimfw: 1
blocks: {p: {kind: random_walk, unit: m, sigma: 2 m, noise: 0.1 m/sqrt(s)}}
measurements: {fix: {kind: direct, of: [{block: p}], noise: 1 m}}
"""


def test_a_config_without_a_source_can_be_checked_and_says_what_to_run_it_on(estimfw: Run) -> None:
    Path("bare.yaml").write_text(NO_SOURCE)
    told = estimfw("check", "bare.yaml")
    assert told.code == 0 and "note: the config has no source" in told.out
    told = estimfw("run", "bare.yaml")
    assert told.code == 3
    assert "the config has no source" in told.err
    for kind in ("log", "simulate_model", "inertial.imu_log"):
        assert f"{{kind: {kind}, " in told.err


@pytest.mark.parametrize(
    "source", ["{kind: log, streams: {fix: {file: fix.csv}}}", "{kind: simulate_model, duration: 60 s, rate: 1 Hz}"]
)
def test_the_sources_that_are_suggested_are_accepted(estimfw: Run, source: str) -> None:
    Path("bare.yaml").write_text(f"{NO_SOURCE}source: {source}\n")
    Path("fix.csv").write_text("time,fix\n1,0.5\n2,0.4\n")
    assert estimfw("run", "bare.yaml", "--json").code == 0


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="no folder that nobody can write into")
@pytest.mark.parametrize("words", [("run", TRACKER, "-o", "/proc/x"), ("schema", "--write", "/proc/x")])
def test_where_nothing_can_be_written_no_space_is_asked_for(estimfw: Run, words: tuple[str, ...]) -> None:
    told = estimfw(*words)
    assert told.code == 5
    assert told.err.startswith("error: /proc/x: cannot write: ") and "space" not in told.err


@pytest.mark.parametrize("width", [80, 200])
def test_kinds_of_plugins_are_whole_so_that_they_can_be_copied(estimfw: Run, width: int) -> None:
    out = estimfw("plugins", "show", "sins_static", width=width).out
    assert "sins_static.bias_in_navigation_frame" in out.split()
    assert "…" not in out
    shown = json.loads(estimfw("plugins", "show", "sins_static", "--json").out)
    assert {c["kind"] for c in shown["plugins"][0]["components"]} <= set(out.split())


def test_a_kind_shows_its_settings_with_unit_default_and_meaning(estimfw: Run) -> None:
    assert "plugins show KIND" in estimfw("plugins", "show", "inertial").err
    lines = [
        " ".join(line.split()) for line in estimfw("plugins", "show", "inertial.imu_log", width=200).out.splitlines()
    ]
    assert lines[0] == "inertial.imu_log (source): recorded IMU: NPZ, CSV or PSINS .imu"
    assert "file required text path of the log" in lines
    assert any(line.startswith("longest_gap s 0.1 s such as") for line in lines)
    assert any(line.startswith("mounting.yaw rad 0 rad") for line in lines)


def test_a_kind_of_the_framework_and_a_kind_that_is_not_there(estimfw: Run) -> None:
    (found,) = json.loads(estimfw("plugins", "show", "gauss_markov", "--json").out)["components"]
    settings = {one["name"]: one for one in found["settings"]}
    assert found["role"] == "block" and settings["correlation_time"]["default"] == "required"
    told = estimfw("plugins", "show", "inertial.imu_lgo")
    assert told.code == 2 and "did you mean 'inertial.imu_log'" in told.err


def test_every_kind_that_is_installed_has_its_sheet(estimfw: Run) -> None:
    """Against the models themselves: the same top-level names, and those without a default are required."""
    from estimfw.config.installed import installed_components
    from estimfw.config.json_schema import filter_schema
    from estimfw.config.settings_sheet import settings_sheet

    registry = installed_components()
    definitions = filter_schema(registry)["$defs"]
    for plugin in registry.plugins:
        for one in plugin.components:
            sheet = settings_sheet(definitions, one.role, plugin.id_of(one))
            fields = {name: field for name, field in one.config.model_fields.items() if name != "kind"}
            assert {row.name.partition(".")[0].removesuffix("[i]") for row in sheet} == set(fields)
            needed = {row.name for row in sheet if row.default == "required" and row.name in fields}
            plain = {row.name for row in sheet}
            assert needed == {name for name, field in fields.items() if field.is_required() and name in plain}


def test_no_command_is_answered_with_the_commands(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, expected in (([], "explain"), (["plugins"], "show")):
        assert main(arguments) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert told.err.startswith("Usage: estimfw") and expected in told.err and "error:" not in told.err
