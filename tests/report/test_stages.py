"""Stages in tables and pictures: names, instants and beliefs of a run that has them, nothing of one that has none."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

from estimfw.config.compose import Problem
from estimfw.report.charts import charts_of
from estimfw.report.explain import explain_json
from estimfw.report.explain_text import explanation
from estimfw.report.interactive import plotly_figure
from estimfw.report.judgement import sigma_caveat
from estimfw.report.page import page
from estimfw.report.pictures import draw
from estimfw.report.stages import stage_table
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem
from estimfw.run.summary import events_of

TRACKER = """\
estimfw: 1
name: a tracker in two steps
blocks:
  position: {kind: random_constant, unit: m, axes: [x, y], sigma: 50 m}
  velocity: {kind: random_walk, unit: m/s, axes: [x, y], sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)}
  bias: {kind: random_constant, unit: m, sigma: 2 m}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}], noise: 3 m}
  beacon: {kind: direct, of: [{block: position, axes: [x]}, {block: bias}], rows: [x], noise: 1 m}
estimator: {kind: kalman, stages: [%s]}
source: {kind: simulate_model, duration: 60 s, rate: 2 Hz, seed: 7}
"""
TWO = "{name: alone, until: 40 s, estimate: [position, velocity], measurements: [fix]}, {name: 'with <beacon>'}"


@pytest.fixture(scope="module")
def staged(composed: Callable[[str], Problem]) -> xr.Dataset:
    return result_dataset(run_problem(composed(TRACKER % TWO)))


def test_the_table_says_what_was_believed_and_measured_when(staged: xr.Dataset) -> None:
    rows = [[cell.text for cell in row] for row in stage_table(staged).rows]
    assert rows[0] == ["alone", "0", "40", "position\nvelocity", "bias", "–", "fix"]
    assert rows[1] == ["with <beacon>", "40", "60", "position\nvelocity\nbias", "–", "–", "fix\nbeacon"]


def test_a_line_with_its_name_stands_where_a_stage_begins(staged: xr.Dataset) -> None:
    chart = next(one for one in charts_of(staged, 500) if one.key == "states_position")
    assert chart.marks == ((0.0, "alone"), (40.0, "with <beacon>"))
    layout = plotly_figure(chart)["layout"]
    assert [shape["x0"] for shape in layout["shapes"]] == [0.0, 40.0]
    assert "with &lt;beacon&gt;" in [note["text"] for note in layout["annotations"]]
    lines = [
        float(np.asarray(line.get_xdata())[0]) for line in draw(chart).axes[-1].lines if line.get_linestyle() == ":"
    ]
    assert lines == [0.0, 40.0]


def test_what_a_stage_does_not_measure_is_no_outage(staged: xr.Dataset) -> None:
    assert not [e for e in events_of(staged) if e.kind == "outage"]
    assert int(staged.sizes["beacon_time"]) == 40


def test_the_page_has_them_and_says_what_the_own_sigmas_do_not_know(staged: xr.Dataset) -> None:
    told = page(staged)
    assert "<h2>Stages</h2>" in told and "with &lt;beacon&gt;" in told
    assert "through all stages" in sigma_caveat(staged)


def test_a_run_without_stages_shows_none(composed: Callable[[str], Problem]) -> None:
    plain = result_dataset(run_problem(composed(TRACKER.replace(", stages: [%s]", ""))))
    assert not stage_table(plain).rows and "Stages</h2>" not in page(plain)
    assert all(not chart.marks for chart in charts_of(plain, 500))


def test_explain_tells_of_them(composed: Callable[[str], Problem]) -> None:
    problem = composed(TRACKER % TWO)
    first, second = explain_json(problem)["estimation_stages"]
    assert first == {"name": "alone", "until": 40.0, "held": ["bias"], "considered": [], "measurements": ["fix"]}
    assert second["until"] is None and second["measurements"] == ["fix", "beacon"]
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(*explanation(problem))
    told = console.export_text()
    assert "stages of the estimation" in told and "with <beacon>" in told


def test_stages_that_hold_nothing_have_the_own_sigmas_as_the_honest_ones(composed: Callable[[str], Problem]) -> None:
    text = TRACKER % "{name: a, until: 20 s, measurements: [fix]}, {name: b, consider: [bias]}"
    result = result_dataset(run_problem(composed(text)))
    assert "No stage holds anything" in sigma_caveat(result)
    assert float(abs(result["honest_sigma"] / result["sigma"] - 1.0).max()) < 1e-6
