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
