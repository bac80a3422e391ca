"""The page on partition and cost says what its commands say."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from estimfw.cli.main import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "partition_and_cost.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^    estimfw (.+)$", PAGE, flags=re.MULTILINE)


def words_of(command: str) -> list[str]:
    """With the examples where they are."""
    return [str(ROOT / w) if w.startswith("examples/") else w for w in shlex.split(command)]


@pytest.mark.parametrize("command", [c for c in COMMANDS if "--measure" not in c])  # that one: tests/cli/test_cost.py
def test_each_command_does_its_work(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("results").mkdir()
    assert main(words_of(command)) == 0


def test_the_table_has_the_figures_of_the_first_command(capsys: pytest.CaptureFixture[str]) -> None:
    command = COMMANDS[0].partition(" -o ")[0]
    assert main([*words_of(command), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    rows = re.findall(
        r"^\| `cross_covariance: (drop|decoupled)` \| ([\d. ]+) \| ([\d.]+) \|$", PAGE, flags=re.MULTILINE
    )
    assert len(rows) == 2
    for form, *printed in rows:
        for text, by in zip(printed, answer["partitions"], strict=True):
            number = text.replace(" ", "")
            half = 0.5 * 10.0 ** -len(number.partition(".")[2])
            assert by["true_over_optimal_sigma"][form]["largest"] == pytest.approx(float(number), abs=half)
