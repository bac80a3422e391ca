"""A reduced filter against the truth that it leaves something out of: its own sigmas fail, its honest ones pass."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from estimfw.montecarlo.draw import draw_runs
from estimfw.report.montecarlo_tables import verdict_table
from estimfw.run.load import load_record

#: Fixes that are off by a constant, which one policy leaves out.
BIASED = """
estimfw: 1
name: tracker with biased fixes
blocks:
  position: {kind: random_constant, unit: m, axes: [x], sigma: 50 m}
  velocity: {kind: random_walk, unit: m/s, axes: [x], sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)}
  offset: {kind: random_constant, unit: m, axes: [x], sigma: 4 m}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}, {block: offset}], rows: [x], noise: 3 m}
policies: POLICIES
estimator: {kind: kalman, covariance_samples: 20}
source: {kind: simulate_model, duration: 40 s, rate: 2 Hz, seed: 7}
"""
REDUCED = BIASED.replace("POLICIES", "[{kind: drop_states, states: ['offset[x]']}]")


def failed(dataset: xr.Dataset, figure: str) -> set[str]:
    entries = json.loads(dataset.attrs["judged"])
    return {e["quantity"] for e in entries if e["figure"] == figure and not e["consistent"]}


def test_the_same_record_is_simulated_whatever_the_policies(composed: Callable[..., Any]) -> None:
    whole, reduced = composed(BIASED.replace("POLICIES", "[]")), composed(REDUCED)
    one, other = (load_record(problem) for problem in (whole, reduced))
    np.testing.assert_array_equal(one.streams["fix"].values, other.streams["fix"].values)
    one, other = (draw_runs(problem, 1, [3]).record for problem in (whole, reduced))
    np.testing.assert_array_equal(one.streams["fix"].values, other.streams["fix"].values)


def test_a_log_is_asked_for_nothing_that_the_filter_does_not_read(
    composed: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The policy takes the offset, and with it the only measurement that sees it alone.
    check = "  check: {kind: direct, of: [{block: offset}], rows: [x], noise: 1 m}\npolicies:"
    text = REDUCED.replace("policies:", check)
    logged = text[: text.rindex("source:")] + "source: {kind: log, streams: {fix: {file: fix.csv}}}\n"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fix.csv").write_text("time,x\n1.0,2.0\n2.0,3.0\n")
    record = load_record(composed(logged))
    assert list(record.streams) == ["fix"]


def test_honest_sigmas_pass_where_the_own_ones_do_not(
    composed: Callable[..., Any], judged_runs: Callable[..., xr.Dataset]
) -> None:
    dataset = judged_runs(composed(REDUCED), 200)
    assert "position[x]" in failed(dataset, "NEES")
    assert failed(dataset, "honest NEES") == set()
    # What is checked is the honest one.
    entries = {(e["figure"], e["quantity"]): e["checked"] for e in json.loads(dataset.attrs["judged"])}
    assert entries[("honest NEES", "position[x]")] and not entries[("NEES", "position[x]")]
    # Against the closed form: once settled, an offset of 4 m on top of what the filter knows.
    own, honest = (float(dataset[name].sel(state="position[x]")[-1]) for name in ("sigma", "honest_sigma"))
    assert abs(honest / np.hypot(own, 4.0) - 1.0) < 0.01
    assert abs(float(dataset["honest_ratio"].sel(state="position[x]")[-1]) - 1.0) < 0.2


HELD = """
estimfw: 1
name: position held for a while, then gated
blocks:
  position: {kind: random_constant, unit: m, axes: [x], sigma: 5 m}
  velocity: {kind: random_walk, unit: m/s, axes: [x], sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}], noise: 3 m}
  speed: {kind: direct, of: [{block: velocity}], noise: 0.2 m/s}
estimator:
  kind: kalman
  gate: 0.999
  covariance_samples: 20
  stages: [{name: held, until: 20 s, estimate: [velocity], measurements: [speed]}, {name: both}]
source: {kind: simulate_model, duration: 40 s, rate: 2 Hz, seed: 7}
"""


def test_what_is_held_for_a_while_is_judged_where_it_is_estimated(
    composed: Callable[..., Any], judged_runs: Callable[..., xr.Dataset]
) -> None:
    result = judged_runs(composed(HELD), 20)
    entries = {(e["quantity"], e["figure"]): e for e in json.loads(result.attrs["judged"])}
    own, honest = entries["position[x]", "NEES"], entries["position[x]", "honest NEES"]
    assert np.isnan(result["nees"].sel(quantity="position[x]").to_numpy()[0]) and np.isfinite(own["over_time"]["mean"])
    assert honest["checked"] and np.isfinite(honest["over_time"]["mean"])


def test_gates_that_refuse_much_are_told_beside_honest_sigmas(
    composed: Callable[..., Any], judged_runs: Callable[..., xr.Dataset]
) -> None:
    result = judged_runs(composed(HELD), 20)
    share = float(result["gated"].sel(measurement="fix").mean())
    assert share > 0.05
    assert f"fix was gated in {100 * share:.0f} % of its epochs" in verdict_table(result).note
    free = judged_runs(composed(HELD.replace("  gate: 0.999\n", "")), 20)
    assert float(free["gated"].max()) == 0.0 and "gated" not in verdict_table(free).note
