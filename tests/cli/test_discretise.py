"""``estimfw discretise``, as somebody at a terminal calls it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Told

TRACKER = "examples/tracker.yaml"
SHORT = ("--set", "source.duration=20 s")


def test_the_answer_in_json(estimfw: Callable[..., Told]) -> None:
    told = estimfw("discretise", TRACKER, *SHORT, "--steps", "500 ms, 1 s", "--json")
    answer = json.loads(told.out)
    assert answer["steps"] == [0.5, 1.0] and answer["at"] == "the reference nominal"
    found = {one["key"]: one for one in answer["formulas"]}
    assert found["second"]["indefinite"] == [True, True]
    assert found["third_printed"]["own_error"][1] == pytest.approx(0.25)
    assert found["van_loan"]["order"] is None
    assert {one["key"] for one in answer["sigmas"]} == {"first", "second", "third", "held_noise"}


def test_what_a_person_reads(estimfw: Callable[..., Told]) -> None:
    told = estimfw("discretise", TRACKER, *SHORT)
    assert told.code == 0
    for text in (
        "no covariance (a negative eigenvalue): second order, at steps of 1 s, 10 s, 60 s, 300 s",
        "Orders of convergence",
        "third order with 4, 6, 4",
        "largest change of a sigma",
    ):
        assert text in told.out


def test_a_page_is_written_once(estimfw: Callable[..., Told]) -> None:
    words = ("discretise", TRACKER, "--no-record", "-o", "page.html")
    assert estimfw(*words).code == 0
    page = Path("page.html").read_text()
    assert '"type":"log"' in page and "step, s" in page and "The filter was not run." in page
    assert estimfw(*words).code == 5
    assert estimfw(*words, "--force").code == 0


def test_at_an_instant_of_the_record_the_dynamics_are_those_there(estimfw: Callable[..., Told]) -> None:
    # A swaying base: the specific force in n varies, and with it how tilts and biases drive the velocity.
    words = ("examples/static_12.yaml", "--set", "source.duration=4 s", "--set", "policies=[]", "--no-record", "--json")
    sway = ("--set", "source.sway={amplitude: [1 deg, 2 deg, 3 deg], period: 4 s}")
    reference, there = (json.loads(estimfw("discretise", *words, *sway, *at).out) for at in ((), ("--at", "2 s")))
    assert there["at"] == "2 s of the record"
    assert there["formulas"][0]["error"] != reference["formulas"][0]["error"]
    told = estimfw("discretise", *words[:-1], "--at", "5 s")
    assert told.code == 2 and "the run goes from 0 to 4 s" in told.err


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("--steps", "10"), 2, "'10' is no time"),
        (("--steps", "1 s, 3 m"), 2, "'3 m' is no time"),
        (("--steps", "0 s"), 2, "a step of '0 s' is none"),
        (("--steps", "1 s,1 s"), 2, "'1 s' and '1 s' are the same step"),
        (("--steps", "60 s, 10 s, 1 min"), 2, "'60 s' and '1 min' are the same step"),
        (("--at", "soon"), 2, "--at"),
        (("-o", "page.pdf"), 2, "page.html"),
    ],
)
def test_slips_are_told(estimfw: Callable[..., Told], arguments: tuple[str, ...], code: int, text: str) -> None:
    told = estimfw("discretise", TRACKER, *SHORT, *arguments)
    assert told.code == code and text in told.err


def test_what_has_no_noise_is_refused(estimfw: Callable[..., Told]) -> None:
    Path("still.yaml").write_text("estimfw: 1\nblocks:\n  a: {kind: random_constant, unit: m, sigma: 5 m}\n")
    told = estimfw("discretise", "still.yaml")
    assert told.code == 3 and "no noise drives the states" in told.err


def test_check_tells_of_a_series_that_is_no_covariance(estimfw: Callable[..., Told]) -> None:
    told = estimfw(
        "check", TRACKER, *SHORT, "--set", "estimator.discretisation={method: series, phi_order: 2, q_order: 2}"
    )
    assert told.code == 0 and "no covariance at steps of" in told.out
