"""Measurements and models that break a careless filter (33, 45, 48, 50, 53, 54), as a user sees what became of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Check = Callable[..., Any]
Tracker = Callable[..., str]


@pytest.fixture
def done(check: Check, logged: str, folder: Path) -> Callable[..., dict[str, Any]]:
    """The answer of a run of the tracker on a log."""

    def run(log: str, *more: str) -> dict[str, Any]:
        (folder / "fix.csv").write_text(log)
        told = check(logged, "--json", *more, command="run")
        assert told.code == 0, told.err + told.out
        answer: dict[str, Any] = json.loads(told.out)
        return answer

    return run


def events(answer: dict[str, Any], kind: str) -> list[tuple[str, float, int]]:
    return [(e["source"], e["time"], e["count"]) for e in answer["events"] if e["kind"] == kind]


@pytest.mark.parametrize("bad", ["", "nan", "inf", "-inf"], ids=["33-empty", "33-nan", "33-inf", "33-minus-inf"])
def test_33_a_component_that_is_no_number_is_skipped_and_the_rest_fused(
    done: Callable[..., dict[str, Any]], fixes: str, bad: str
) -> None:
    row = "10.0,20.5,40.5"
    whole, holed = done(fixes), done(fixes.replace(row, f"10.0,{bad},40.5"))
    less = done(fixes.replace(row + "\n", ""))
    assert holed["dispositions"]["fused"] == 20
    assert events(holed, "missing") == [("fix", 10.0, 1)]
    assert "fix.csv:21" in next(e["text"] for e in holed["events"] if e["kind"] == "missing")
    for axis, like in (("x", None), ("y", whole)):
        state = holed["states"][f"position[{axis}]"]
        assert np.isfinite(state["value"])
        if like is not None:  # the axes are independent: y is as if nothing had happened
            assert state["value"] == pytest.approx(like["states"]["position[y]"]["value"], rel=1e-12)
            assert state["sigma"] == pytest.approx(like["states"]["position[y]"]["sigma"], rel=1e-12)
        else:
            assert state["sigma"] > whole["states"]["position[x]"]["sigma"]
    assert less["time"] == 9.5


def test_45_a_single_outlier_is_gated_and_flagged(done: Callable[..., dict[str, Any]], fixes: str) -> None:
    row = "5.0,10.5,20.5\n"
    answer, without = done(fixes.replace(row, "5.0,1e5,20.5\n")), done(fixes.replace(row, "5.0,,\n"))
    assert answer["dispositions"] == without["dispositions"] | {"gated": 1, "missing": 0}
    assert events(answer, "gated") == [("fix", 5.0, 1)]
    assert "beyond the gate of 13.82" in next(e["text"] for e in answer["events"] if e["kind"] == "gated")
    for label, state in without["states"].items():
        assert answer["states"][label]["value"] == pytest.approx(state["value"], rel=1e-12)


def test_48_a_pole_is_refused_and_its_neighbourhood_a_warning(
    check: Check, standing: str, imu: Any, folder: Path
) -> None:
    (folder / "log.csv").write_text(imu.csv())
    told = check(standing, "--set", "site.latitude=90 deg")
    assert told.code == 6
    told.says("latitude 90 deg: there is no North at a pole, and no gyrocompass")
    told = check(standing, "--set", "site.latitude=-90 deg")
    assert told.code == 6
    told = check(standing, "--set", "site.latitude=89.5 deg", "--set", "source.checks=false")
    assert told.code == 0
    assert "warning: latitude 89.5 deg: within a degree of a pole" in told.err
    assert (
        "within a degree of a pole"
        not in check(standing, "--set", "site.latitude=88 deg", "--set", "source.checks=false").err
    )
    told = check(standing, "--set", "site.latitude=91 deg")
    assert told.code == 3
    told.says("site.latitude: '91 deg' is outside -90 deg..90 deg")


def test_50_two_tiny_noises_under_a_huge_prior_leave_ud_positive(check: Check, tracker: Tracker) -> None:
    fix = "fix: {kind: direct, of: [{block: position}], noise: 1e-6 m}"
    config = tracker(
        "fix: {kind: direct, of: [{block: position}], noise: 3 m}", f"{fix}\n  {fix.replace('fix', 'fix2')}"
    )
    told = check(
        config.replace("sigma: 50 m", "sigma: 1e9 m").replace("gate: 0.999", "covariance: ud"), "--json", command="run"
    )
    assert told.code == 0
    answer = json.loads(told.out)
    assert answer["dispositions"]["fused"] == 40
    for label in ("position[x]", "position[y]"):
        sigma = answer["states"][label]["sigma"]
        # Both tell the position to 1e-6 m, so together at least to 1e-6 / sqrt(2); the walk adds nothing to that in one step.
        assert 0.0 < sigma <= 1e-6 / np.sqrt(2.0) * (1.0 + 1e-6)


def test_53_a_singular_innovation_covariance_is_skipped_and_flagged(check: Check, tracker: Tracker) -> None:
    fix = "fix: {kind: direct, of: [{block: position}], noise: 0 m, perfect: true}"
    config = tracker(
        "fix: {kind: direct, of: [{block: position}], noise: 3 m}", f"{fix}\n  {fix.replace('fix', 'again')}"
    )
    told = check(config, "--json", command="run")
    assert told.code == 0
    answer = json.loads(told.out)
    assert answer["measurements"]["fix"]["fused"] == 20
    assert answer["measurements"]["again"]["invalid"] == 20
    ((source, _, count),) = events(answer, "invalid")
    assert (source, count) == ("again", 20)
    for state in answer["states"].values():
        assert np.isfinite(state["value"])
        assert abs(state["error"]) < 5.0


DECAY = "kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}"


@pytest.mark.parametrize("rate", [50.0, 5000.0])
def test_54_stiff_dynamics_are_sub_stepped(check: Check, tracker: Tracker, rate: float) -> None:
    """A velocity that decays within a hundredth of a step has forgotten its start: its sigma is the steady one."""
    own = f"{DECAY}\n  drag: {{kind: couple, target: velocity, source: velocity, coefficient: -{rate}}}"
    told = check(tracker(DECAY, own), "--json", command="run")
    assert told.code == 0
    sigma = json.loads(told.out)["states"]["velocity[x]"]["sigma"]
    assert sigma == pytest.approx(0.3 / np.sqrt(2.0 * rate), rel=0.02)


def test_54_dynamics_too_stiff_for_any_sub_steps_are_refused(check: Check, tracker: Tracker) -> None:
    own = f"{DECAY}\n  drag: {{kind: couple, target: velocity, source: velocity, coefficient: -1e9}}"
    told = check(tracker(DECAY, own))
    assert told.code == 6
    told.says(
        "the dynamics are too stiff for the step: |eigenvalue of F| x dt = 5e+08 (dt = 0.5 s)", "drop the fast states"
    )


def test_54_dynamics_that_grow_without_bound_are_refused(
    check: Check, tracker: Tracker, fixes: str, folder: Path
) -> None:
    own = f"{DECAY}\n  drag: {{kind: couple, target: velocity, source: velocity, coefficient: 500}}"
    told = check(tracker(DECAY, own), "--json", command="run")
    assert told.code == 6
    told.says("the simulated position[", "left the numbers at t = ", "grows without bound")
