"""The line that an error points at."""

from __future__ import annotations

from pathlib import Path

import pytest

from estimfw.cli.excerpt import excerpt
from estimfw.errors import Location


def test_the_mark_stands_below_the_column(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("one\n  two: 3\n", encoding="utf-8")
    shown, mark = excerpt(Location(str(path), 2, 8)).splitlines()
    assert shown == "  2 |   two: 3"
    assert shown[mark.index("^")] == "3"


@pytest.mark.parametrize("column", [1, 40, 500, 980, 1000])
def test_a_long_line_is_cut_to_a_window_around_the_column(tmp_path: Path, column: int) -> None:
    path = tmp_path / "a.yaml"
    line = "".join(chr(ord("a") + i % 26) for i in range(1000))
    path.write_text(line)
    shown, mark = excerpt(Location(str(path), 1, column)).splitlines()
    assert len(shown) < 120
    assert shown[mark.index("^")] == line[column - 1]


def test_control_characters_are_not_sent_to_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"a: \x1b[31m\xff\n")
    assert "\x1b" not in excerpt(Location(str(path), 1, 1))


@pytest.mark.parametrize("place", [None, Location("nothing.yaml", 1, 1), Location("a.yaml"), Location("--set a", 1)])
def test_where_there_is_no_line_nothing_is_shown(place: Location | None) -> None:
    assert excerpt(place) == ""


def test_a_binary_file_and_a_line_beyond_the_end_show_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"\0\1\n2\n")
    assert excerpt(Location(str(path), 1, 1)) == ""
    assert excerpt(Location(str(path), 9, 1)) == ""
