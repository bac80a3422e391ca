"""The page on references that go bad does what it says."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw import Session, open_filter
from estimfw.cli.main import main

PAGE = (Path(__file__).parents[2] / "docs" / "faults.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The reader's folder, with the page's configs in it."""
    for text in blocks("yaml"):
        name = re.match(r"# (\S+)\n", text)
        assert name is not None
        (tmp_path / name.group(1)).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def answered(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["run", *arguments, "--json"]) == 0
    made: dict[str, Any] = json.loads(capsys.readouterr().out)
    return made


def test_a_good_record_passes_all_checks(capsys: pytest.CaptureFixture[str]) -> None:
    answer = answered(capsys, "checked.yaml")
    assert {e["kind"] for e in answer["events"]} <= {"gated"}
    assert answer["dispositions"]["fused"] >= 395


def test_a_log_with_arrivals_is_run_as_a_live_filter_would_have_met_it(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    t = np.arange(1.0, 101.0)
    came = t + 0.01
    came[[20, 60]] += [3.5, 12.5]
    order = np.argsort(came)
    rows = [f"{t[k]},{came[k]},{2.0 * t[k]},{-t[k]}" for k in order]
    (folder / "fix.csv").write_text("\n".join(["time,received,x,y", *rows]) + "\n")
    answer = answered(capsys, "late.yaml")
    found = {e["kind"]: (e["time"], e["count"]) for e in answer["events"]}
    assert found["replayed"] == (21.0, 1)
    assert found["late"] == (61.0, 1)
    assert answer["dispositions"]["late"] == 1


def test_the_session_ends_as_one_that_got_its_rows_in_order() -> None:
    (code,) = blocks("python")
    names: dict[str, Any] = {}
    exec(code, names)
    late, in_order = names["session"], Session(open_filter("checked.yaml", ["preprocess={}"]))
    for t in (0.5, 1.0, 1.5, 2.0):
        in_order.measure("fix", t, [2.0 * t, -t])
        in_order.advance(t)
    assert late.estimate is not None
    assert in_order.estimate is not None
    assert late.estimate.states == in_order.estimate.states
    assert late.counts["fix"]["fused"] == 4


def test_each_event_of_the_page_is_one_of_the_program() -> None:
    """Kinds that the table names stand in the sources as such."""
    sources = "".join(p.read_text(encoding="utf-8") for p in (Path(__file__).parents[2] / "estimfw").rglob("*.py"))
    kinds = {
        kind
        for row in PAGE.splitlines()
        if row.startswith("| ")
        for kind in re.findall(r"`([a-z ]+)`", row.split("|")[3])
    }
    assert len(kinds) == 12
    for kind in kinds:
        assert f'"{kind}"' in sources, kind
