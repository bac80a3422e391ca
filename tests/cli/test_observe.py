"""``estimfw observe``, as somebody at a terminal calls it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Told

TRACKER = "examples/tracker_bias.yaml"
SHORT = ("--set", "source.duration=20 s")


def test_the_answer_in_json(estimfw: Callable[..., Told]) -> None:
    told = estimfw("observe", TRACKER, *SHORT, "--json")
    answer = json.loads(told.out)
    keys = ["states", "rank", "spectrum", "directions", "degrees", "removable_sets", "chosen"]
    assert set(keys) <= set(answer)
    assert answer["rank"] == 6 and len(answer["spectrum"]["kept"]) == 6
    assert answer["chosen"] in answer["removable_sets"]
    assert len(answer["degrees"]["posterior"]["position[x]"]) == len(answer["degrees"]["time"])
    direction = answer["directions"][0]
    assert direction["terms"][0] == {"state": "position[x]", "coefficient": 1.0, "unit": "1"}


def test_what_a_person_reads(estimfw: Callable[..., Told]) -> None:
    told = estimfw("observe", TRACKER, *SHORT)
    assert told.code == 0
    for text in (
        "rank 6 of 8",
        "position[x] - beacon_bias[x] - radar_bias[x]",
        "would remove beacon_bias[x], beacon_bias[y]",
    ):
        assert text in told.out


def test_without_a_record_it_says_so(estimfw: Callable[..., Told]) -> None:
    told = estimfw("observe", TRACKER, "--no-record")
    assert "only the frozen analysis" in told.err
    assert "Along the record" not in told.out


def test_a_filter_with_stages_is_told_its_frozen_part_and_what_is_left_out(estimfw: Callable[..., Told]) -> None:
    told = estimfw("observe", "examples/ins_staged.yaml", "-o", "page.html")
    assert told.code == 0
    assert "of 14: 3 combinations of states are not observable" in told.out  # accelerometers with tilts, latitude
    assert "Along the record" not in told.out
    assert "the filter has stages" in told.err and "only the frozen analysis" in told.err
    assert "the filter has stages" in Path("page.html").read_text()


def test_a_page_is_written_once(estimfw: Callable[..., Told]) -> None:
    first = estimfw("observe", TRACKER, *SHORT, "-o", "page.html")
    page = Path("page.html").read_text()
    assert first.code == 0
    assert page.count('"type":"heatmap"') == 2 and "would remove" in page
    assert "time, s" in page and "sigma /" in page
    assert estimfw("observe", TRACKER, *SHORT, "-o", "page.html").code == 5
    assert estimfw("observe", TRACKER, *SHORT, "-o", "page.html", "--force").code == 0


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("--protect", "radar_bais"), 3, "did you mean 'radar_bias'"),
        (("--segments", "0"), 2, "segments"),
        (("-o", "page.pdf"), 2, "page.html"),
    ],
)
def test_slips_are_told(estimfw: Callable[..., Told], arguments: tuple[str, ...], code: int, text: str) -> None:
    told = estimfw("observe", TRACKER, *SHORT, *arguments)
    assert told.code == code and text in told.err


def test_nothing_measured_is_told_plainly(estimfw: Callable[..., Told]) -> None:
    Path("blind.yaml").write_text(
        "estimfw: 1\nname: blind\nblocks:\n  a: {kind: random_constant, unit: m, sigma: 5 m}\n"
    )
    told = estimfw("observe", "blind.yaml")
    assert told.code == 0
    assert "rank 0 of 1" in told.out and "nothing would be left" in told.out
    assert "the config has no source" in told.err


def test_many_states_are_told_briefly_and_a_stopped_search_is_said(estimfw: Callable[..., Told]) -> None:
    axes = ", ".join(f"s{i}" for i in range(40))
    blocks = [
        f"  {n}: {{kind: random_constant, unit: m, axes: [{axes}], sigma: {s} m}}" for n, s in (("a", 50), ("b", 5))
    ]
    measured = "measurements:\n  z: {kind: direct, of: [{block: a}, {block: b}], noise: 3 m}\n"
    Path("many.yaml").write_text("\n".join(["estimfw: 1", "name: many", "blocks:", *blocks, measured]))
    told = estimfw("observe", "many.yaml")
    assert told.code == 0
    assert "40 in all" in told.out and "the search was stopped after" in told.out
    assert "would remove b[s0], b[s1]" in told.out
    assert "20 more: see --json" in told.out
