"""A discretisation study in the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from estimfw.report.discretisation_tables import (
    EIGENVALUES,
    ERRORS,
    ORDERS,
    SIGMAS,
    eigenvalue_table,
    error_table,
    headline,
    order_table,
    sigma_table,
)
from estimfw.report.terminal import TONES, print_table
from estimfw.run.discretisation import StudiedFilter

__all__ = ["print_study"]


def print_study(found: StudiedFilter, console: Console) -> None:
    """Print it, what is wrong first."""
    console.print(Text(found.name, style="bold"))
    first, *bad = headline(found)
    console.print(Text(first))
    for line in bad:
        console.print(Text(line, style=TONES["bad"]))
    print_table(console, ORDERS, order_table(found))
    print_table(console, ERRORS, error_table(found))
    print_table(console, EIGENVALUES, eigenvalue_table(found))
    print_table(console, SIGMAS, sigma_table(found))
