"""The page on filters in several nodes does what it says."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import estimfw
from estimfw.cli.main import main
from estimfw.report.nodes import node_table
from estimfw.run.run import run_problem

PAGE = (Path(__file__).parents[2] / "docs" / "decentralised.md").read_text(encoding="utf-8")
SILENT = re.findall(r"--set '(.*)'$", PAGE, flags=re.MULTILINE)[0]


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The reader's folder, with nodes.yaml and threads.py in it."""
    (tmp_path / "nodes.yaml").write_text(blocks("yaml")[0])
    (tmp_path / "threads.py").write_text(blocks("python")[0])
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_the_run_is_that_of_one_filter_and_tells_its_nodes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "nodes.yaml", "-o", "results/nodes", "--no-report"]) == 0
    assert "Nodes and what they sent" in capsys.readouterr().out
    result = xr.load_dataset("results/nodes/result.nc", engine="h5netcdf")
    nodes = run_problem(estimfw.open_filter("nodes.yaml", ["estimator.gate=null"]))
    one = run_problem(estimfw.open_filter("nodes.yaml", ["estimator={kind: kalman, covariance: joseph}"]))
    assert np.abs((nodes.estimate - one.estimate) / one.sigma).max() < 1e-9
    exchange = json.loads(result.attrs["exchange"])
    assert [node["name"] for node in exchange["nodes"]] == ["east", "north"]
    assert exchange["words"] == sum(sum(node["words"].values()) for node in exchange["nodes"]) > 0
    summary = json.loads((folder / "results/nodes/summary.json").read_text())
    assert summary["exchange"] == exchange
    rows = [[cell.text for cell in row] for row in node_table(result).rows]
    assert [row[:3] for row in rows] == [
        ["east", "position[x], velocity[x]", "fix@east, speed"],
        ["north", "position[y], velocity[y]", "fix@north"],
    ]


def test_a_silent_node_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "nodes.yaml", "-o", "results/silent", "--no-report", "--set", SILENT]) == 0
    told = capsys.readouterr().out
    assert "node silent" in told
    result = xr.load_dataset("results/silent/result.nc", engine="h5netcdf")
    missing = result["fix@north_disposition"].to_numpy() == 3
    time = result["fix@north_time"].to_numpy()
    np.testing.assert_array_equal(missing, (time >= 20.0) & (time < 30.0))


def test_suboptimal_forms_have_a_true_sigma(folder: Path) -> None:
    for form in ("drop", "decoupled"):
        run = run_problem(estimfw.open_filter("nodes.yaml", [f"estimator.cross_covariance={form}"]))
        assert run.honest is not None
        assert np.all(run.honest.sigma[-1] > 0.999 * run.sigma[-1])


def test_nodes_in_threads_that_exchange_text_say_the_same(folder: Path) -> None:
    wanted = run_problem(estimfw.open_filter("nodes.yaml"))
    found: dict[str, object] = {}
    try:
        exec(compile(blocks("python")[1], "page", "exec"), found)
    finally:
        sys.modules.pop("threads", None)
    result = found["result"]
    np.testing.assert_array_equal(result.estimate, wanted.estimate)  # type: ignore[attr-defined]
    np.testing.assert_array_equal(result.disposition, wanted.disposition)  # type: ignore[attr-defined]
