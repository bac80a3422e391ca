"""``estimfw montecarlo`` as somebody at a terminal, or a build server, sees it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Estimfw = Callable[..., Any]
SHORT = ("--runs", "30", "--workers", "1", "--set", "source.duration=20 s", "--set", "estimator.gate=null")


def test_it_writes_result_page_and_pictures_and_tells_what_it_found(estimfw: Estimfw, tmp_path: Path) -> None:
    told = estimfw("montecarlo", "examples/tracker.yaml", *SHORT, "-o", "out/mc.nc", "--check")
    assert told.code == 0, told.err
    assert "30 runs" in told.out and "all states" in told.out and "consistent" in told.out
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"mc.nc", "mc.html", "mc_figures"}
    assert {"nees.png", "nis.png", "errors_position.png"} <= {p.name for p in (tmp_path / "out/mc_figures").iterdir()}
    page = (tmp_path / "out/mc.html").read_text(encoding="utf-8")
    assert "NEES over time" in page and 'id="figure-nees"' in page
    again = estimfw("montecarlo", "examples/tracker.yaml", *SHORT, "-o", "out/mc.nc")
    assert again.code == 5 and "--force" in again.err


def test_json_alone_writes_nothing(estimfw: Estimfw, tmp_path: Path) -> None:
    told = estimfw("montecarlo", "examples/tracker.yaml", *SHORT, "--json")
    found = json.loads(told.out)
    assert found["consistent"] is True and found["runs"] == 30
    assert found["states"]["position[x]"]["unit"] == "m"
    assert list(tmp_path.iterdir()) == []


def test_check_fails_with_its_own_exit_code_and_names_what(estimfw: Estimfw) -> None:
    # A base that does not move at all, and R = (0.1 m/s)^2: 30 times too large.
    still = ("montecarlo", "examples/static_12.yaml", "--runs", "30", "--workers", "1", "--set", "source.duration=60 s")
    assert estimfw(*still, "--json").code == 0
    told = estimfw(*still, "--json", "--check")
    assert told.code == 8
    assert "NIS of zero_velocity" in told.err


@pytest.mark.parametrize("words", [("--runs", "1"), ("--workers", "0"), ("--confidence", "2")])
def test_numbers_that_make_no_sense_are_usage_errors(estimfw: Estimfw, words: tuple[str, str]) -> None:
    assert estimfw("montecarlo", "examples/tracker.yaml", *words).code == 2


def test_the_example_passes_and_its_own_sigmas_are_told_to_be_too_small(estimfw: Estimfw) -> None:
    told = estimfw("montecarlo", "examples/monte_carlo_7.yaml", "--runs", "60", "--workers", "1", "--json", "--check")
    assert told.code == 0, told.err
    found = {(e["figure"], e["quantity"]): e for e in json.loads(told.out)["judged"]}
    assert found[("honest NEES", "attitude_error")]["verdict"] == "consistent"
    assert found[("NEES", "attitude_error")]["verdict"] == "sigmas too small"


def test_a_smoother_that_does_not_act_is_told(estimfw: Estimfw) -> None:
    short = ("--set", "source.duration=5 s", "--runs", "2", "--workers", "1", "--json")
    told = estimfw("montecarlo", "examples/tracker_smoothed.yaml", *short)
    assert told.code == 0 and "the smoother does not act over many runs" in told.err
    assert "smoother" not in estimfw("montecarlo", "examples/tracker.yaml", *short).err
