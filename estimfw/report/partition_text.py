"""A partition in the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from estimfw.report.partition_tables import (
    EXACT,
    MEASURES,
    advice,
    basis_texts,
    group_table,
    nodes_yaml,
    objective_text,
    price_table,
    same_cut,
    warning_texts,
)
from estimfw.report.terminal import print_table
from estimfw.run.partition import Partitioned

__all__ = ["print_partition"]


def print_partition(found: Partitioned, console: Console) -> None:
    """Print groups, what they are worth, and what to paste."""
    sizes = ", ".join(map(str, found.sizes))
    title = f"{found.name}: {len(found.states)} states in {len(found.sizes)} groups of {sizes}"
    console.print(Text(title, style="bold"))
    for text in basis_texts(found):
        console.print(Text(f"  {text}"))
    for text in warning_texts(found):
        console.print(Text(f"  warning: {text}", style="yellow"))
    shown = [found.by_correlation] if same_cut(found) else [found.by_correlation, found.by_coupling]
    for by in shown:
        print_table(console, f"Groups by {MEASURES[by.measure]}", group_table(by))
        console.print(Text(objective_text(by, found.states), style="dim"))
    print_table(console, "What neglecting the covariances between groups costs", price_table(found))
    console.print()
    console.print(Text(EXACT))
    console.print(Text(advice(found), style="bold"))
    for by in shown:
        console.print()
        console.print(Text(f"# groups by {MEASURES[by.measure]}", style="dim"))
        console.print(Text(nodes_yaml(by)), soft_wrap=True)
