"""The option ``-o FILE.html`` of commands that write a page."""

from __future__ import annotations

from pathlib import Path

from estimfw.errors import UsageError

__all__ = ["refuse_page"]


def refuse_page(output: Path | None, *, force: bool) -> None:
    """Before anything runs: a page that is named like something else, or that is there.

    Raises
    ------
    UsageError, DataError
    """
    from estimfw.run.files import refuse_existing

    if output is None:
        return
    if output.suffix.lower() not in {".html", ".htm"}:
        raise UsageError(f"the page is HTML, not {output.name!r}", hint=f"name it: -o {output.with_suffix('.html')}")
    refuse_existing(output, force=force)
