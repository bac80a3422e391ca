"""``estimfw cost``, as somebody at a terminal calls it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Told
from tests.run.gravimeter_text import gravimeter

TRACKER = ("examples/tracker.yaml", "--set", "source.duration=20 s")


def line_of(told: Told, text: str) -> list[str]:
    return next(row for row in told.out.splitlines() if row.startswith(text)).replace("\u2009", "").split()


def test_the_table_and_a_plain_verdict_are_printed(estimfw: Callable[..., Told]) -> None:
    Path("g.yaml").write_text(gravimeter(30, 60))
    told = estimfw("cost", "g.yaml", "--into", "2")
    assert told.code == 0, told.err
    assert line_of(told, "textbook")[-5:] == ["3628", "3628", "100.0", "%", "1.78"]
    assert line_of(told, "2 nodes, all together")[-5:] == ["2162", "2162", "59.6", "%", "1.06"]
    words = " ".join(told.out.replace("\u2009", "").split())
    assert "On one processor it does not pay" in words
    assert "89 words take 5.7 µs, and all that is saved is 948 ns" in words
    assert "it pays from 86 states on" in words


def test_a_quick_link_makes_it_pay(estimfw: Callable[..., Told]) -> None:
    link = ("--latency", "0 s", "--bandwidth", "1000 GB/s", "--multiply-time", "10 ns")
    told = estimfw("cost", *TRACKER, "--into", "2", *link)
    assert "it pays with this link" in told.out


def test_the_answer_in_json_has_forms_and_prediction(estimfw: Callable[..., Told]) -> None:
    answer = json.loads(estimfw("cost", *TRACKER, "--sizes", "2,2", "--json").out)
    assert {f["form"] for f in answer["forms"]} == {
        "textbook",
        "joseph_at_once",
        "symmetric",
        "selecting",
        "pattern",
        "ud",
    }
    nodes = answer["nodes"]
    assert nodes["sizes"] == [2, 2] and nodes["link"] == {"latency": 5e-5, "word": 6.4e-8, "multiplication": 1e-9}
    predicted = nodes["predicted"]
    assert predicted["several_processors"] > predicted["one_processor"] and predicted["speed_up"] < 1.0


def test_without_nodes_only_one_processor_is_told(estimfw: Callable[..., Told]) -> None:
    told = estimfw("cost", *TRACKER)
    assert told.code == 0 and "processors" not in told.out and "--into 2" in told.err


def test_a_page_and_pictures_are_written_once(estimfw: Callable[..., Told]) -> None:
    assert estimfw("cost", *TRACKER, "--into", "2", "-o", "page.html").code == 0
    assert "Predicted speed-up over the number of states" in Path("page.html").read_text()
    for name in ("page_speed_up_states.png", "page_speed_up_latency.png"):
        assert Path(name).read_bytes().startswith(b"\x89PNG")
    assert estimfw("cost", *TRACKER, "--into", "2", "-o", "page.html").code == 5


def test_faults_of_usage_say_what_to_write(estimfw: Callable[..., Told]) -> None:
    for arguments, what in (
        (("--latency", "5"), "--latency '50 us'"),
        (("--latency", "-1 us"), "--latency '50 us'"),
        (("--multiply-time", "0 ns"), "--multiply-time '1 ns'"),
        (("--bandwidth", "1 m/s"), "125 MB/s"),
        (("--into", "9"), "--into 4 is the most"),
        (("-o", "page.png"), "page.html"),
    ):
        told = estimfw("cost", *TRACKER, *arguments)
        assert told.code == 2 and what in told.err, arguments


def test_a_hundred_states_in_five_nodes_are_timed_beside_the_prediction(estimfw: Callable[..., Told]) -> None:
    answer = json.loads(
        estimfw("cost", "examples/chain_100.yaml", "--set", "source.duration=3 s", "--measure", "--json").out
    )
    # The specification of the gravimeter's alignment, section 3: 100 states, 10 rows, 5 subsystems.
    forms = {f["form"]: f["multiplications"] for f in (*answer["forms"], *answer["nodes"]["forms"])}
    assert [forms[k] for k in ("textbook", "symmetric", "selecting")] == [3233000, 1669500, 1567500]
    assert [forms[k] for k in ("decentralised", "triangular", "busiest")] == [1693640, 1589140, 339240]
    assert answer["nodes"]["words"]["formula"] == 6175
    measured = answer["measured"]
    assert measured["one_node"]["multiplications"] == 2233000
    assert measured["busiest"]["measured"] < measured["together"]["measured"]
    assert measured["busiest"]["predicted"] == pytest.approx(measured["multiplication"] * 339240)
    assert measured["largest_difference_in_sigmas"] < 1e-9
    assert min(measured["as_run"].values()) > 0.0
    assert any(text.startswith("Measured here") for text in answer["verdicts"])


@pytest.mark.slow
def test_the_work_of_a_hundred_states_is_what_a_run_on_counting_numbers_takes(estimfw: Callable[..., Told]) -> None:
    answer = json.loads(estimfw("cost", "examples/chain_100.yaml", "--count", "--json").out)
    for form in (*answer["forms"], *answer["nodes"]["forms"]):
        if form["form"] != "busiest":
            assert form["counted"] == form["multiplications"], form["form"]
    assert answer["nodes"]["words"]["sent"] == 6175


def test_nodes_are_not_cut_again_and_are_needed_for_timing(estimfw: Callable[..., Told]) -> None:
    told = estimfw("cost", "examples/tracker_decentralised.yaml", "--into", "2")
    assert told.code == 2 and "has nodes already" in told.err
    told = estimfw("cost", *TRACKER, "--measure")
    assert told.code == 2 and "--into 2" in told.err
