"""Each correction on the page about the paper holds for the model that the program builds."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "zhu_zhang.md").read_text(encoding="utf-8")
CODE = re.compile(r"^```python\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)

INTRODUCTION, *PARTS = re.split(r"^### (?=\d+\. )", PAGE, flags=re.MULTILINE)


def code_of(part: str) -> str:
    (found,) = CODE.findall(part)
    return str(found)


def run(code: str, names: dict[str, Any], part: str) -> dict[str, Any]:
    exec(compile(code, f"zhu_zhang.md, {part}", "exec"), names)
    return names


@pytest.fixture(scope="module")
def prepared() -> dict[str, Any]:
    """The names of the page's beginning, and of no. 1, to which later parts refer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return run(code_of(PARTS[0]), run(code_of(INTRODUCTION), {}, "beginning"), "1")


def test_the_page_has_all_fifteen_corrections_in_order_and_each_has_a_check() -> None:
    assert [int(part.partition(".")[0]) for part in PARTS] == list(range(1, 16))
    assert all("assert " in code_of(part) for part in PARTS)


@pytest.mark.parametrize("part", PARTS, ids=[part.partition("\n")[0] for part in PARTS])
def test_correction_holds(part: str, prepared: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    run(code_of(part), dict(prepared), part.partition(".")[0])
