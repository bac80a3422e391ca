"""What a step costs, in the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from estimfw.report.cost_tables import exchange_table, form_table, measured_table, times_table, verdicts
from estimfw.report.terminal import print_table
from estimfw.run.cost import Costed
from estimfw.run.measured_cost import Measured

__all__ = ["print_cost"]


def print_cost(costed: Costed, console: Console, measured: Measured | None = None) -> None:
    """Print what each form costs, and whether several processors gain."""
    title = f"{costed.name}: {costed.states} states, {costed.rows} rows of measurements"
    console.print(Text(title, style="bold"))
    print_table(console, "Multiplications of a step", form_table(costed))
    if costed.cut is None:
        return
    print_table(console, "Nodes", exchange_table(costed.cut))
    print_table(console, "A processor for each node", times_table(costed.cut))
    if measured is not None:
        print_table(console, "Measured beside predicted", measured_table(costed, measured))
    for text in verdicts(costed, measured):
        console.print()
        console.print(Text(text, style="bold"))
