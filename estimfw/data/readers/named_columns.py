"""Columns of a text table by the names in its header line."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimfw.data.readers.number_table import NumberTable, decoded
from estimfw.errors import DataError, Location
from estimfw.spelling import did_you_mean

__all__ = ["read_columns"]

FloatArray = NDArray[np.float64]

_SEPARATORS = (",", ";", "\t", "|", " ")


def read_columns(
    path: Path, columns: Sequence[str], separator: str = ",", decimal: str = ".", say: str = ""
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Numbers (N, len(columns)), NaN where a cell is empty, and the line (N,) of each row.

    Blank lines and lines with ``#`` before the header are skipped; further columns are ignored, whatever they hold.

    Parameters
    ----------
    path : Path
    columns : sequence of str
        Names in the header line.
    separator, decimal : str
    say : str
        How a config names the columns, for the hint where some are missing.

    Raises
    ------
    DataError
        With the line: no text, no such column or one twice, another width, a cell that is no number, no rows.
    """
    names, text, first_line = _split_header(path, decoded(path), separator)
    places = _places(path, names, columns, separator, first_line - 1, say)
    table = NumberTable(path, text, first_line, len(names), separator, decimal)
    values = table.values(places)
    return values, table.lines(len(values))


def _split_header(path: Path, text: str, separator: str) -> tuple[list[str], str, int]:
    """Column names, the text after them, and the line at which it begins."""
    rest, number = text, 0
    while rest:
        line, _, rest = rest.partition("\n")
        number += 1
        if line.strip() and not line.startswith("#"):
            return [name.strip().strip('"') for name in line.split(separator)], rest, number + 1
    raise DataError(
        "the file is empty", location=Location(str(path)), hint="expected a line of column names and rows of numbers"
    )


def _places(
    path: Path, names: list[str], columns: Sequence[str], separator: str, line: int, say: str
) -> tuple[int, ...]:
    """Where the columns stand."""
    twice = [name for name, count in Counter(names).items() if count > 1 and name in columns]
    if twice:
        raise DataError(
            f"the column {twice[0]!r} stands {names.count(twice[0])} times in the header",
            location=Location(str(path), line),
            hint=f"columns found: {', '.join(repr(n) for n in names[:20])}",
        )
    missing = [name for name in columns if name not in names]
    if missing:
        raise DataError(
            f"no column{'s' * (len(missing) > 1)} {', '.join(repr(name) for name in missing)}",
            location=Location(str(path), line),
            hint=_missing_hint(missing, names, len(columns), separator, say),
        )
    return tuple(names.index(name) for name in columns)


def _missing_hint(missing: list[str], names: list[str], count: int, separator: str, say: str) -> str:
    found = f"columns found: {', '.join(repr(n) for n in names[:20])}"
    if len(names) == 1:
        other = [s for s in _SEPARATORS if s != separator and len(names[0].split(s)) >= count]
        if other:
            said = json.dumps(other[0]) if other[0] == "\t" else repr(other[0])
            return f"{found}; the columns seem to be separated by {said}: say `separator: {said}`"
    if all(_is_number(n) for n in names):
        return f"{found}; the first line must hold the names of the columns"
    near = did_you_mean(missing[0], names) if len(missing) == 1 else ""
    guess = [near.split(" (valid")[0]] if near.startswith("did") else []
    return "; ".join([found, *guess, *([say] if say else [])])


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
