"""Tables of numbers in text files: read strictly, and with the line of whatever is wrong.

pandas reads such files too, but fills a short row with NaN, renames a duplicate column and takes a wrong separator for one
column of text. ``numpy.loadtxt`` refuses all that, exactly and no slower; what it does not say is the line in the file.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import DataError, Location

__all__ = ["NumberTable", "decoded"]

FloatArray = NDArray[np.float64]

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


@dataclass(frozen=True, slots=True)
class NumberTable:
    """The rows of a text file from one line on.

    Attributes
    ----------
    path : Path
    text : str
        What follows the header.
    first_line : int
        Line of the file (from 1) in which ``text`` begins.
    width : int
        Columns of every row.
    separator : str or None
        None: white space.
    decimal : str
    """

    path: Path
    text: str
    first_line: int
    width: int
    separator: str | None = None
    decimal: str = "."

    def values(self, columns: tuple[int, ...]) -> FloatArray:
        """The numbers (N, len(columns)) of some columns (from 0); an empty cell is NaN.

        Raises
        ------
        DataError
            No rows, a row of another width, a cell that is no number; with its line.
        """
        if not self.text.strip():
            raise DataError("no data rows", location=Location(str(self.path)), hint="the file ends after its header")
        self._check_widths()
        try:
            return self._load(self._pointed(self.text), columns)
        except ValueError:
            return self._load_with_holes(columns)

    def lines(self, rows: int) -> NDArray[np.int64]:
        """The line of each row."""
        if self.text.count("\n") + (not self.text.endswith("\n")) == rows:
            return self.first_line + np.arange(rows, dtype=np.int64)
        held = [n for n, line in enumerate(self.text.split("\n"), self.first_line) if line.strip()]
        return np.array(held, dtype=np.int64)

    def _load(self, text: str, columns: tuple[int, ...]) -> FloatArray:
        return np.loadtxt(
            io.StringIO(text), delimiter=self.separator, usecols=columns, ndmin=2, comments=None, quotechar='"'
        )

    def _load_with_holes(self, columns: tuple[int, ...]) -> FloatArray:
        text = self._pointed(self.text)
        if (mark := self.separator) is not None:
            rows = (line.split(mark) for line in text.split("\n") if line.strip())
            text = "\n".join(mark.join(cell if cell.strip() else "nan" for cell in row) for row in rows)
        try:
            return self._load(text, columns)
        except ValueError as cause:
            raise self._bad_cell(columns, str(cause)) from None

    def _pointed(self, text: str) -> str:
        return text if self.decimal == "." else text.replace(self.decimal, ".")

    def _check_widths(self) -> None:
        """Every row that is not blank has ``width`` columns."""
        widths = self._widths()
        wrong = np.flatnonzero((widths != self.width) & (widths > 0))
        if wrong.size == 0:
            return
        row, found = int(wrong[0]), int(widths[wrong[0]])
        last = row == int(np.flatnonzero(widths)[-1])
        mostly = wrong.size > np.count_nonzero(widths) / 2
        if last and found < self.width:
            hint = "the file seems to be cut off: delete its last line, or fetch it again"
        elif self.separator == "," and found > self.width and mostly:
            hint = "decimal commas? Then the columns need another separator: `separator: ';'` and `decimal: ','`"
        else:
            hint = "every row needs as many columns as the header"
        raise DataError(f"{found} columns, expected {self.width}", location=self._at(row), hint=hint)

    def _widths(self) -> NDArray[np.int64]:
        """Columns of each line; 0 in a blank one."""
        lines = self.text.split("\n")
        if self.separator is None:
            return np.array([len(line.split()) for line in lines], dtype=np.int64)
        return np.array([line.count(self.separator) + 1 if line.strip() else 0 for line in lines], dtype=np.int64)

    def _bad_cell(self, columns: tuple[int, ...], cause: str) -> DataError:
        for row, line in enumerate(self.text.split("\n")):
            cells = line.split(self.separator)
            for column in columns if line.strip() else ():
                cell = cells[column].strip().strip('"')
                if cell and not _is_number(self._pointed(cell)):
                    return DataError(
                        f"{cell[:40]!r} in column {column + 1} is not a number",
                        location=self._at(row),
                        hint=_cell_hint(cell),
                    )
        return DataError(f"cannot read the numbers: {cause}", location=Location(str(self.path)))

    def _at(self, row: int) -> Location:
        return Location(str(self.path), self.first_line + row)


def decoded(path: Path) -> str:
    """The text of a file, lines ending in ``\\n``; a byte order mark is dropped.

    Raises
    ------
    DataError
        Not text in UTF-8.
    """
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        line = data[: cause.start].count(b"\n") + 1
        raise DataError(
            f"byte {cause.start} is not text in UTF-8",
            location=Location(str(path), line),
            hint="is this a binary file?",
        ) from None
    if "\0" in text:
        place = text.index("\0")
        raise DataError(
            f"byte {place} is zero: not a text file", location=Location(str(path), text[:place].count("\n") + 1)
        )
    return text.replace("\r\n", "\n")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _cell_hint(cell: str) -> str:
    if _DECIMAL_COMMA.fullmatch(cell):
        return "a decimal comma? Then say `decimal: ','`"
    return "expected a number, such as 0.01 or 1e-3; leave a missing one empty"
