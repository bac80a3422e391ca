"""``estimfw budget``, as somebody at a terminal calls it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.cli.conftest import Told

EXAMPLES = Path(__file__).parents[2] / "examples"
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


def test_a_truth_of_something_else_is_refused(estimfw: Callable[..., Told]) -> None:
    told = estimfw("budget", *TRACKER, "--truth", "examples/static_12.yaml")
    assert told.code == 3
    assert "no state in common" in told.err and "attitude_error[E]" in told.err


def test_a_truth_that_lacks_what_the_filter_measures_is_refused_with_the_nearest(estimfw: Callable[..., Told]) -> None:
    text = (EXAMPLES / "tracker.yaml").read_text()
    Path("other.yaml").write_text(text.replace("  fix:", "  fixx:"))
    told = estimfw("budget", *TRACKER, "--truth", "other.yaml")
    assert told.code == 3
    assert "does not measure fix[x]" in told.err and "fixx[x]" in told.err


def test_states_that_are_zero_in_the_truth_are_named(estimfw: Callable[..., Told]) -> None:
    told = estimfw("budget", "examples/tracker_bias.yaml", "--set", "source.duration=20 s", "--truth", "lesser.yaml")
    assert told.code != 0
    text = (EXAMPLES / "tracker_bias.yaml").read_text()
    lesser = "\n".join(line for line in text.splitlines() if not line.startswith("  beacon_bias:"))
    Path("lesser.yaml").write_text(lesser.replace(", {block: beacon_bias}", "").replace("{block: beacon_bias}", ""))
    told = estimfw("budget", "examples/tracker_bias.yaml", "--set", "source.duration=20 s", "--truth", "lesser.yaml")
    assert told.code == 0, told.err
    assert "zero in that model: beacon_bias[x], beacon_bias[y]" in told.out


def test_other_pages_than_html_are_refused(estimfw: Callable[..., Told]) -> None:
    told = estimfw("budget", *TRACKER, "-o", "page.pdf")
    assert told.code != 0 and "page.html" in told.err
