"""``estimfw trial``, as somebody at a terminal calls it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from tests.cli.conftest import Told

ARGUMENTS = ("examples/static_12.yaml", "examples/static_7.yaml", "--set", "source.duration=20 s", "--runs", "4")
CLAIMS = """\
claims:
  - {text: seven states do no worse, of: [static_7, static_12], output: attitude.pitch, at: 20 s, below: 1.5}
  - {text: nobody errs, of: [static_7], output: attitude.pitch, below: 1e-9}
"""


def test_tables_pictures_and_verdicts(estimfw: Callable[..., Told]) -> None:
    Path("claims.yaml").write_text(CLAIMS)
    told = estimfw(
        "trial",
        *ARGUMENTS,
        "--at",
        "10",
        "--settled",
        "attitude.pitch=5,0.001",
        "--claims",
        "claims.yaml",
        "-o",
        "page.html",
    )
    assert told.code == 0
    for text in ("Root mean square errors", "never", "seven states do no worse", "holds", "does not"):
        assert text in told.out
    assert Path("page_rms.png").exists() and "nobody errs" in Path("page.html").read_text()


def test_an_empty_file_of_claims_is_told_what_it_begins_with(estimfw: Callable[..., Told]) -> None:
    Path("none.yaml").write_text("")
    told = estimfw("trial", *ARGUMENTS, "--claims", "none.yaml")
    assert told.code == 3 and "begin with 'claims:'" in told.err


def test_a_claim_that_does_not_hold_fails_the_check(estimfw: Callable[..., Told]) -> None:
    Path("claims.yaml").write_text(CLAIMS)
    told = estimfw("trial", *ARGUMENTS, "--claims", "claims.yaml", "--check", "--json")
    assert told.code == 8 and "1 of 2 claims do not hold: nobody errs" in told.err
    answer = json.loads(told.out)
    assert [c["holds"] for c in answer["claims"]] == [True, False]
    assert len(answer["filters"]["static_7"]["attitude.pitch"]["end"]) == 4


def test_bounds_that_are_none_are_refused(estimfw: Callable[..., Told]) -> None:
    told = estimfw("trial", *ARGUMENTS, "--settled", "attitude.pitch")
    assert told.code == 2 and "--settled attitude.yaw=1,0.5" in told.err


def test_a_smoother_that_does_not_act_is_told(estimfw: Callable[..., Told]) -> None:
    short = ("--set", "source.duration=5 s", "--runs", "2", "--workers", "1", "--json")
    told = estimfw("trial", "examples/tracker_smoothed.yaml", *short)
    assert told.code == 0 and "the smoother does not act over many runs" in told.err
    assert "smoother" not in estimfw("trial", "examples/tracker.yaml", *short).err
