"""``estimfw budget``, as somebody at a terminal calls it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.cli.conftest import Told

STATIC = ("examples/static_7.yaml", "--set", "source.duration=30 s")
TRACKER = ("examples/tracker.yaml", "--set", "source.duration=20 s")


def test_the_answer_in_json_adds_up(estimfw: Callable[..., Told]) -> None:
    answer = json.loads(estimfw("budget", *STATIC, "--json").out)
    yaw = next(q for q in answer["quantities"] if q["label"] == "attitude.yaw")
    parts = np.array(yaw["contributions"])
    assert parts.shape == (len(answer["sources"]), len(answer["time"]))
    np.testing.assert_allclose(np.sqrt((parts**2).sum(axis=0)), yaw["honest_sigma"], rtol=1e-9)
    assert yaw["largest"][0] == "attitude_error[U]"


def test_the_largest_three_are_named_for_every_output_and_the_table_ends_with_the_sums(
    estimfw: Callable[..., Told],
) -> None:
    told = estimfw("budget", *STATIC).out
    line = next(row for row in told.splitlines() if row.strip().startswith("attitude.yaw:"))
    assert "initial error attitude_error[U]" in line
    assert told.index("total: honest sigma") < told.index("the filter's own sigma")
    assert "removed state" in told


def test_states_stand_for_the_outputs_of_a_filter_without_any(estimfw: Callable[..., Told]) -> None:
    told = estimfw("budget", *TRACKER).out
    assert "position[x]:" in told and "measurement noise fix[x]" in told


def test_a_page_and_a_picture_are_written_once(estimfw: Callable[..., Told]) -> None:
    assert estimfw("budget", *TRACKER, "-o", "page.html").code == 0
    assert Path("page.png").read_bytes().startswith(b"\x89PNG")
    assert "Largest sources at 20 s" in Path("page.html").read_text()
    again = estimfw("budget", *TRACKER, "-o", "page.html")
    assert again.code != 0 and "page.html" in again.err
    assert estimfw("budget", *TRACKER, "-o", "page.html", "--force").code == 0


def test_a_truth_that_the_nominal_cannot_make_is_told(estimfw: Callable[..., Told]) -> None:
    told = estimfw("budget", *TRACKER, "--truth", "examples/static_12.yaml")
    assert told.code != 0
    assert "nominal variable" in told.err
    assert "Traceback" not in told.err


def test_other_pages_than_html_are_refused(estimfw: Callable[..., Told]) -> None:
    told = estimfw("budget", *TRACKER, "-o", "page.pdf")
    assert told.code != 0 and "page.html" in told.err
