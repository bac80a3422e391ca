"""Published figures, to stand beside ours: a CSV with the columns filter, value, output, published, unit."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from estimfw.errors import ConfigError, DataError, Location
from estimfw.units.unit_text import parse_unit

__all__ = ["COLUMNS", "Published", "read_published"]

COLUMNS = ("filter", "value", "output", "published", "unit")


@dataclass(frozen=True, slots=True)
class Published:
    """A published error: of which ``filter``, at which point of the grid (``value``, its label), of which ``output``; SI."""

    filter: str
    value: str
    output: str
    figure: float


def read_published(path: Path) -> tuple[Published, ...]:
    """Read the figures; lines that begin with ``#`` say where they come from.

    Raises
    ------
    DataError
        The file cannot be read, lacks a column, or holds what is no number or unit; with its line.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as fault:
        raise DataError(f"cannot read the published figures: {fault}", location=Location(str(path))) from fault
    return tuple(_rows(path, lines))


def _rows(path: Path, lines: list[str]) -> Iterator[Published]:
    numbers = [i for i, line in enumerate(lines, start=1) if line.strip() and not line.lstrip().startswith("#")]
    if not numbers:
        raise DataError("no published figures in it", location=Location(str(path)), hint=f"columns {','.join(COLUMNS)}")
    rows = csv.DictReader((lines[i - 1] for i in numbers), skipinitialspace=True)
    missing = [c for c in COLUMNS if c not in (rows.fieldnames or ())]
    if missing:
        place = Location(str(path), numbers[0], 1)
        raise DataError(f"no column {missing[0]!r}", location=place, hint=f"columns are {','.join(COLUMNS)}")
    for number, row in zip(numbers[1:], rows, strict=True):
        text = {c: (row[c] or "").strip() for c in COLUMNS}
        try:
            figure = float(text["published"]) * float(parse_unit(text["unit"]).scale)
        except (ValueError, ConfigError) as fault:
            place = Location(str(path), number, 1)
            raise DataError(f"no number with a unit: {fault}", location=place, hint="such as 0.0458,deg") from fault
        yield Published(text["filter"], text["value"], text["output"], figure)
