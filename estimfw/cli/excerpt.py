"""The line that an error points at, with a mark below its column."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

from estimfw.errors import Location

__all__ = ["excerpt"]

_WIDTH = 100
_LONGEST = 1 << 16


def excerpt(place: Location | None) -> str:
    """One or two lines of text, each ending with a newline; empty where there is no such line to show.

    A long line is cut to a window around the column.
    """
    if place is None or place.line is None:
        return ""
    line = _line(Path(place.file), place.line)
    if line is None or not line.strip():
        return ""
    at = (place.column or 1) - 1
    first = max(0, min(at - _WIDTH // 2, len(line) - _WIDTH))
    shown = ("..." if first else "") + line[first : first + _WIDTH] + ("..." if first + _WIDTH < len(line) else "")
    number = str(place.line)
    text = f"  {number} | {shown}\n"
    if place.column is None:
        return text
    return text + f"  {' ' * len(number)} | {' ' * (at - first + (3 if first else 0))}^\n"


def _line(path: Path, number: int) -> str | None:
    """A line of a text file (from 1), control characters as spaces; None where there is none."""
    try:
        with path.open("rb") as file:
            raw = next(islice(file, number - 1, None), None)
    except (OSError, ValueError):
        return None
    if raw is None or b"\0" in raw or len(raw) > _LONGEST:
        return None
    text = raw.decode("utf-8-sig" if number == 1 else "utf-8", errors="replace").rstrip("\r\n")
    return "".join(c if c.isprintable() else " " for c in text)
