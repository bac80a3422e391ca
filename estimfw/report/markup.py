"""Small pieces of HTML. Whatever comes from a result is escaped here, and only here."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

from estimfw.report.tables import Cell, Table

__all__ = ["data_block", "facts", "note", "table"]

LONG = 40


def table(content: Table) -> str:
    """A table that scrolls sideways on a narrow screen; an empty one is a sentence."""
    if not content.rows:
        return note("None.")
    head = "".join(f"<th{_kind(column, content)}>{escape(text)}</th>" for column, text in enumerate(content.head))
    body = "".join(
        f"<tr>{''.join(_cell(cell, column, content) for column, cell in enumerate(row))}</tr>\n" for row in content.rows
    )
    return f'<div class="scroll"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n' + (
        note(content.note) if content.note else ""
    )


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Names and texts as a definition list; pairs without a text are left out."""
    rows = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>\n" for name, text in pairs if text)
    return f'<dl class="facts">\n{rows}</dl>\n'


def note(text: str) -> str:
    """A sentence in small print."""
    return f'<p class="note">{escape(text)}</p>\n'


def data_block(identity: str, data: Mapping[str, Any]) -> str:
    """JSON for the page's script; no text in it can end the block."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f'<script type="application/json" id="{escape(identity)}">{text}</script>\n'


def _kind(column: int, content: Table) -> str:
    return ' class="number"' if column in content.numeric else ""


def _cell(cell: Cell, column: int, content: Table) -> str:
    text = f'<span class="tone {cell.tone}">{escape(cell.text)}</span>' if cell.tone else escape(cell.text)
    longest = max(map(len, cell.text.splitlines()), default=0)
    length = ' class="long"' if longest > LONG else ' class="short"' if "\n" not in cell.text else ""
    kind = _kind(column, content) or (length if column else "")
    return f"<td{kind}>{text}</td>"
