"""An error budget in the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from estimfw.report.budget_tables import largest_texts, source_table
from estimfw.report.numbers import instant
from estimfw.report.terminal import print_table
from estimfw.run.budget import Budget

__all__ = ["print_budget"]


def print_budget(budget: Budget, console: Console) -> None:
    """Print the largest sources, then all of them."""
    console.print(Text(f"Error budget: {budget.name}", style="bold"))
    if budget.truth_name != budget.name:
        console.print(Text(f"on the model of: {budget.truth_name}", style="dim"))
    if budget.absent:
        console.print(Text(f"zero in that model: {', '.join(budget.absent)}", style="yellow"))
    for text in largest_texts(budget):
        console.print(Text(f"  {text}"))
    print_table(console, f"Contributions to sigma at {instant(float(budget.time[-1]))} s", source_table(budget))
