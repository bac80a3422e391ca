"""The page about the paper: its code runs, its files are there."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "yang_2014.md").read_text(encoding="utf-8")
README = (ROOT / "plugins" / "platform_gravimeter" / "README.md").read_text(encoding="utf-8")
CODE = re.compile(r"^```python\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)


def test_the_code_of_the_page_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    names: dict[str, Any] = {}
    parts = CODE.findall(PAGE)
    assert sum("assert " in part for part in parts) == 5
    for number, part in enumerate(parts, start=1):
        exec(compile(part, f"yang_2014.md, piece {number}", "exec"), names)


def test_the_files_that_page_and_readme_name_are_there() -> None:
    named = set(re.findall(r"examples/\w+\.yaml", PAGE + README))
    assert len(named) == 3
    assert all((ROOT / name).is_file() for name in named)
