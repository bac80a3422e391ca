"""An error budget in the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from estimfw.report.budget_tables import largest_texts, shown_quantities, source_table
from estimfw.report.numbers import instant
from estimfw.report.terminal import print_table
from estimfw.run.budget import Budget

__all__ = ["print_budget"]

COLUMNS = 12
"""Quantities above which a table of all sources has no readable width in a terminal."""


def print_budget(budget: Budget, console: Console) -> None:
    """Print the largest sources, then all of them where a table of them can be read."""
    console.print(Text(f"Error budget: {budget.name}", style="bold"))
    if budget.truth_name != budget.name:
        console.print(Text(f"on the model of: {budget.truth_name}", style="dim"))
    if budget.absent:
        console.print(Text(f"zero in that model: {', '.join(budget.absent)}", style="yellow"))
    for text in largest_texts(budget):
        console.print(Text(f"  {text}"))
    count = len(shown_quantities(budget))
    if count > COLUMNS:
        text = f"contributions of all {len(budget.sources)} sources to {count} quantities: on a page (-o FILE.html) or as --json"
        console.print(Text(text, style="dim"))
        return
    print_table(console, f"Contributions to sigma at {instant(float(budget.time[-1]))} s", source_table(budget))
