"""``estimfw cost``, as somebody at a terminal calls it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

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
