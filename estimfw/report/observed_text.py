"""What ``estimfw observe`` found, in the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from estimfw.report.observed_tables import (
    DIRECTIONS_SHOWN,
    chosen_text,
    direction_note,
    headline,
    record_table,
    record_texts,
    removable_table,
    spectrum_texts,
    state_table,
)
from estimfw.report.terminal import TONES, print_table
from estimfw.run.observe import Observed

__all__ = ["print_observed"]


def print_observed(found: Observed, console: Console) -> None:
    """Print it, the rank first."""
    console.print(Text(found.name, style="bold"))
    full = found.frozen.rank == len(found.names.states)
    console.print(Text(headline(found), style=TONES["good" if full else "warn"]))
    for line in spectrum_texts(found.frozen):
        console.print(Text(f"  {line}", style="dim"))
    _print_directions(found, console)
    print_table(console, "States", state_table(found))
    print_table(console, "What could be removed so that the rest is observable", removable_table(found))
    console.print()
    console.print(Text(chosen_text(found)))
    if found.record is not None:
        print_table(console, "Along the record", record_table(found))
        for line in record_texts(found):
            console.print(Text(line))


def _print_directions(found: Observed, console: Console) -> None:
    if not found.directions:
        return
    console.print()
    console.print(Text("Not observable", style="bold"))
    for one in found.directions[:DIRECTIONS_SHOWN]:
        console.print(Text(f"  {one.text}"))
        console.print(Text(f"      such as {one.example}", style="dim"))
    told = direction_note(found)
    if told:
        console.print(Text(told, style="dim"))
