"""Signs of life on standard error, where that is a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from estimfw.run.run import Progress

__all__ = ["busy", "progress"]


@contextmanager
def progress(quiet: bool) -> Iterator[Progress | None]:
    """A rich bar on standard error where that is a terminal."""
    console = _terminal(quiet)
    if console is None:
        yield None
        return
    from rich.progress import Progress as Bar

    with Bar(console=console, transient=True) as bar:
        task = bar.add_task("filtering", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def busy(text: str, quiet: bool) -> Iterator[None]:
    """A sign of life on standard error where that is a terminal."""
    console = _terminal(quiet)
    if console is None:
        yield
        return
    with console.status(text):
        yield


def _terminal(quiet: bool) -> Console | None:
    from rich.console import Console

    made = Console(stderr=True)
    return None if quiet or not made.is_terminal else made
