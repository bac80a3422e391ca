"""The page on the errors of an INS at sea: its code runs, its commands do what it says, its numbers are those of its commands."""

from __future__ import annotations

import json
import math
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

import estimfw
from estimfw.cli.main import main
from estimfw.report.numbers import significant

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "wu_tsang_nie.md").read_text(encoding="utf-8")
COMMANDS = [shlex.split(line)[1:] for line in re.findall(r"^    (estimfw .*)$", PAGE, flags=re.MULTILINE)]
LINES = re.findall(r"^\| (\d)\. (.*) \| (.*) \| (.*) \|$", PAGE, flags=re.MULTILINE)


def at_home(command: list[str]) -> list[str]:
    return [str(ROOT / word) if word.startswith("examples/") else word for word in command]


def test_the_code_of_the_page_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    names: dict[str, Any] = {}
    pieces = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    assert len(pieces) == 4 and all("assert" in piece for piece in pieces[1:])
    for piece in pieces:
        exec(compile(piece, "wu_tsang_nie.md", "exec"), names)


def test_two_commands_correct_a_log_and_the_table_is_what_they_tell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    simulate, run = COMMANDS[:2]
    assert main(at_home(simulate)) == 0
    assert main([*at_home(run), "--no-report"]) == 0
    told = json.loads(Path("results/ins_log/summary.json").read_text())["corrections"]
    rows = re.findall(r"^\| (heading|latitude|longitude) \| (.*) \|$", PAGE, flags=re.MULTILINE)
    assert len(rows) == 3
    for name, cells in rows:
        printed = [cell.split()[0] for cell in cells.split(" | ")]
        one = told[f"{name}.corrected"]
        before, after = one["error_before"], one["error_after"]
        found = [before["rms"], after["rms"], before["end"], after["end"], one["sigma"]]
        for shown, value in zip(printed, found, strict=True):
            half_a_digit = 0.5 * 10.0 ** -len(shown.partition(".")[2])
            assert float(shown) == pytest.approx(value, abs=1.01 * half_a_digit), name
    assert Path("results/ins_log/corrected.csv").exists() and Path("results/ins_log/corrected.npz").exists()


def test_what_large_errors_leave_is_as_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (told,) = re.findall(r"`estimfw (run [^`]*noise=false)`", PAGE)
    monkeypatch.chdir(tmp_path)
    assert main([*at_home(shlex.split(told)), "--no-report", "-o", "still"]) == 0
    states = json.loads(Path("still/summary.json").read_text())["states"]
    east, azimuth = states["velocity_error[E]"], states["attitude_error[U]"]
    assert east["error"] == pytest.approx(0.0004, abs=5e-5) and east["error"] < 0.1 * east["sigma"]
    assert azimuth["error"] * 10800.0 / math.pi == pytest.approx(0.016, abs=5e-4)
    assert azimuth["error"] < 0.1 * azimuth["sigma"]


def test_a_log_of_ones_own_is_a_config_that_extends_the_example(tmp_path: Path) -> None:
    (block,) = re.findall(r"^```yaml\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    for example in (ROOT / "examples").glob("ins_*.yaml"):
        (tmp_path / example.name).write_text(example.read_text())
    (tmp_path / "own.yaml").write_text(block)
    problem = estimfw.open_filter(tmp_path / "own.yaml")
    assert [m.name for m in problem.model.measurements] == ["velocity", "heading"]
    assert "longitude_error" in problem.model.states


@pytest.mark.slow
def test_the_verdicts_and_figures_of_the_page_are_those_of_its_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*at_home(COMMANDS[2])[:2], "--json"]) == 0
    claims = json.loads(capsys.readouterr().out)["claims"]
    assert len(LINES) == 9
    for number, _, verdict, figures in LINES:
        own = [claim for claim in claims if claim["text"].startswith(number)]
        assert own[0]["verdict"] == verdict, number
        computed = {significant(part["figure"], 4) for claim in own for part in claim["parts"]}
        exact = re.findall(r"\d+\.\d{3,}", figures)
        assert exact and set(exact) <= computed, (number, set(exact) - computed)
