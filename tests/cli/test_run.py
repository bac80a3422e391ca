"""``estimfw run``: data on standard output, the rest on standard error, and nothing lost that was there before."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.run.result_file import read_result

Run = Callable[..., Any]
STATIC = ("run", "examples/static_7.yaml", "--set", "source.duration=20 s")
TRACKER = ("run", "examples/tracker.yaml", "--set", "source.duration=10 s")


def test_a_run_writes_result_summary_page_and_pictures_and_says_where(estimfw: Run) -> None:
    told = estimfw(*STATIC)
    assert told.code == 0
    folder = Path("results/static_7")
    assert {p.name for p in folder.iterdir()} >= {"result.nc", "summary.json", "report.html", "figures"}
    pictures = sorted(p.name for p in (folder / "figures").iterdir())
    assert "outputs_attitude.png" in pictures and "nis_zero_velocity.png" in pictures
    assert f"{len(pictures)} pictures" in told.err and str(folder) in told.err
    assert "wrote" not in told.out
    assert json.loads((folder / "summary.json").read_text())["steps"] == 20
    assert read_result(folder / "result.nc").sizes["time"] == 20


def test_the_reduced_model_is_told_at_the_terminal_and_on_the_page(estimfw: Run) -> None:
    told = estimfw(*STATIC)
    line = "The honest sigmas are those of the errors on the unreduced model"
    assert line in told.out
    assert line in Path("results/static_7/report.html").read_text().replace("&#x27;", "'")


def test_json_alone_writes_no_file_and_nothing_else_on_standard_output(estimfw: Run) -> None:
    told = estimfw(*STATIC, "--json")
    answer = json.loads(told.out)
    assert not list(Path().iterdir())
    assert told.err == ""
    assert set(answer["attitude"]) == {"yaw", "pitch", "roll", "heading"}
    assert answer["dispositions"]["fused"] == 20
    assert answer["provenance"]["kernel"] == "numpy"


def test_json_into_a_folder_answers_the_same(estimfw: Run) -> None:
    alone = json.loads(estimfw(*STATIC, "--json").out)
    beside = json.loads(estimfw(*STATIC, "--json", "-o", "here", "--no-report").out)
    del alone["timing"], beside["timing"]
    assert alone == beside
    assert {p.name for p in Path("here").iterdir()} == {"result.nc", "summary.json"}


def test_a_second_run_needs_force_and_is_refused_before_it_computes(
    estimfw: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert estimfw(*TRACKER, "--no-report").code == 0
    before = {p: p.read_bytes() for p in Path("results/tracker").iterdir()}
    with monkeypatch.context() as patch:
        patch.setattr("estimfw.run.run.run_problem", lambda *_: pytest.fail("the filter ran for nothing"))
        told = estimfw(*TRACKER, "--no-report")
    assert told.code == 5
    assert "exists" in told.err and "--force" in told.err
    assert {p: p.read_bytes() for p in Path("results/tracker").iterdir()} == before
    assert estimfw(*TRACKER, "--no-report", "--force", "--set", "source.seed=5").code == 0
    assert Path("results/tracker/result.nc").read_bytes() != before[Path("results/tracker/result.nc")]


def test_csv_has_every_output_in_its_unit_at_every_epoch(estimfw: Run) -> None:
    assert estimfw(*STATIC, "--csv", "--no-report").code == 0
    head, *rows = csv.reader(Path("results/static_7/outputs.csv").read_text().splitlines())
    assert head[:3] == ["time [s]", "attitude.yaw [deg]", "attitude.yaw sigma [deg]"]
    table = np.array(rows, dtype=float)
    result = read_result(Path("results/static_7/result.nc"))
    np.testing.assert_allclose(table[:, 0], result["time"], rtol=1e-11)
    np.testing.assert_allclose(np.radians(table[:, 1]), result["output_value"][:, 0], rtol=1e-10)
    np.testing.assert_allclose(np.radians(table[:, 2]), result["output_sigma"][:, 0], rtol=1e-10)


def test_an_existing_csv_is_not_replaced_without_force(estimfw: Run) -> None:
    Path("results/static_7").mkdir(parents=True)
    Path("results/static_7/outputs.csv").write_text("mine")
    assert estimfw(*STATIC, "--csv", "--no-report").code == 5
    assert Path("results/static_7/outputs.csv").read_text() == "mine"
    assert not Path("results/static_7/result.nc").exists()


def test_at_answers_as_if_the_run_had_ended_there_and_keeps_the_whole_result(estimfw: Run) -> None:
    whole = json.loads(estimfw(*STATIC, "--json").out)
    early = json.loads(estimfw(*STATIC, "--json", "--at", "10").out)
    short = json.loads(estimfw(*STATIC, "--set", "source.duration=10 s", "--json").out)
    assert (whole["time"], early["time"]) == (20.0, 10.0)
    assert early["attitude"]["pitch"]["sigma"] > whole["attitude"]["pitch"]["sigma"]
    for part in ("states", "attitude", "steps", "dispositions", "mean_nis", "measurements", "events", "cautions"):
        assert early[part] == short[part], part
    told = estimfw(*STATIC, "--at", "10", "--no-report", "--csv")
    assert "At 10 s" in told.out and "At the end" not in told.out
    assert len(Path("results/static_7/outputs.csv").read_text().splitlines()) == 11
    assert json.loads(Path("results/static_7/summary.json").read_text())["steps"] == 10
    assert read_result(Path("results/static_7/result.nc")).sizes["time"] == 20


@pytest.mark.parametrize("at", ["20.5", "0", "-1"])
def test_an_instant_outside_of_the_run_is_refused_and_nothing_is_written(estimfw: Run, at: str) -> None:
    told = estimfw(*STATIC, f"--at={at}")
    assert told.code == 2
    assert "outside the run" in told.err and "from 1 to 20 s" in told.err
    assert not list(Path("results/static_7").glob("*"))


def test_a_wrong_start_is_told_beside_the_headline_on_the_page_and_in_the_summary(estimfw: Run) -> None:
    """12 states, and the vehicle stands 10 deg off its configured start, of which the prior says 10 deg for the attitude; gravity
    is projected wrongly, and the vertical accelerometer's bias takes it up."""
    wrong = ("--set", "source.misalignment=[25 deg, 25 deg, 25 deg]", "--set", "source.duration=60 s")
    told = estimfw("run", "examples/static_12.yaml", *wrong)
    assert told.code == 0
    (first, *_) = [line for line in told.out.splitlines() if line.startswith("caution: ")]
    assert "accel_bias[U]" in first and "prior sigmas from its prior" in first
    assert told.out.index("heading") < told.out.index(first) < told.out.index("At the end")
    summary = json.loads(Path("results/static_12/summary.json").read_text())
    assert f"caution: {summary['cautions'][0]}" == first
    assert "implausible" in {event["kind"] for event in summary["events"]}
    assert summary["cautions"][0] in Path("results/static_12/report.html").read_text()


def test_a_right_start_has_no_cautions_and_one_sentence_about_what_is_not_determined(estimfw: Run) -> None:
    told = estimfw("run", "examples/static_12.yaml", "--no-report", "--set", "source.duration=60 s")
    assert "caution" not in told.out
    assert json.loads(Path("results/static_12/summary.json").read_text())["cautions"] == []
    (line,) = [line for line in told.err.splitlines() if "not determined" in line]
    assert line.startswith("3 combinations of states are not determined by the measurements and keep their prior")
    assert "estimfw check lists them" in line
    listed = estimfw("check", "examples/static_12.yaml").err
    assert "accel_bias[R] 100 ug" in listed and "attitude_error[N] 0.00574 deg" in listed


def test_csv_of_a_model_without_outputs_has_its_states(estimfw: Run) -> None:
    assert estimfw(*TRACKER, "--csv", "--no-report").code == 0
    head = Path("results/tracker/outputs.csv").read_text().splitlines()[0].split(",")
    assert head[:4] == ["time [s]", "position[x] [m]", "position[x] sigma [m]", "position[y] [m]"]


def test_csv_with_json_alone_has_nowhere_to_go(estimfw: Run) -> None:
    told = estimfw(*TRACKER, "--csv", "--json")
    assert told.code == 2
    assert "-o FOLDER" in told.err


def test_a_terminal_sees_progress_and_a_pipe_sees_the_result(at_a_terminal: Run) -> None:
    told = at_a_terminal(*TRACKER)
    assert told.code == 0
    assert "filtering" in told.err and "writing the result" in told.err
    assert "position[x]" in told.out
    assert "\x1b" not in told.out and "filtering" not in told.out


def test_without_a_terminal_there_is_no_progress(estimfw: Run) -> None:
    told = estimfw(*TRACKER, "--no-report")
    assert "filtering" not in told.err and "\x1b" not in told.err
