"""A result in the terminal: the attitude, the values at the end, the measurements, the events."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from estimfw.report.bank import bank_line, bank_table
from estimfw.report.correction_table import correction_table
from estimfw.report.headline import Headline, headlines, start_line
from estimfw.report.judgement import sigma_caveat
from estimfw.report.nodes import node_table
from estimfw.report.numbers import UNKNOWN, instant
from estimfw.report.smoother import smoother_table
from estimfw.report.stages import stage_table
from estimfw.report.tables import Table, disposition_table, end_table, event_table, meaning_table
from estimfw.run.plausibility import cautions
from estimfw.run.summary import json_attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["TONES", "print_result", "print_table"]

EVENTS_SHOWN = 10
TONES = {"good": "green", "warn": "yellow", "bad": "bold red"}


def print_result(dataset: xr.Dataset, console: Console, *, at_end: bool = True) -> None:
    """Print what one wants to know after a run.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.
    console : rich.console.Console
        Where to.
    at_end : bool
        The last row is the end of the run, not an instant that somebody asked for.
    """
    console.print(Text(str(dataset.attrs.get("title") or "Estimation result"), style="bold"))
    for entry in json_attribute(dataset, "equivalence", []):
        if entry.get("status") == "mismatch":
            text = f"model and mechanization do not match: {entry.get('operation')}: {entry.get('text')}"
            console.print(Text(text, style=TONES["bad"]))
    for line in headlines(dataset):
        console.print(_headline(line))
    bank = bank_line(dataset)
    if bank:
        console.print(Text(bank))
    start = start_line(dataset)
    if start:
        console.print(Text(start, style="dim"))
    for caution in cautions(dataset):
        console.print(Text(f"caution: {caution}", style=TONES["bad"]))
    caveat = sigma_caveat(dataset)
    if caveat:
        console.print(Text(caveat, style=TONES["warn"]))
    print_table(console, f"{'At the end' if at_end else 'At'}{_last(dataset, at_end)}", end_table(dataset))
    print_table(console, "Smoother", smoother_table(dataset))
    print_table(console, "Before and after the correction", correction_table(dataset))
    print_table(console, "Members of the bank", bank_table(dataset))
    print_table(console, "Stages", stage_table(dataset))
    print_table(console, "Nodes and what they sent", node_table(dataset))
    print_table(console, "What states stand for", meaning_table(dataset))
    print_table(console, "Measurements", disposition_table(dataset, brief=True))
    print_table(console, "Events", event_table(dataset, EVENTS_SHOWN))


def _last(dataset: xr.Dataset, at_end: bool) -> str:
    time = dataset["time"].to_numpy()
    return f"{', ' if at_end else ' '}{instant(float(time[-1]))} s" if time.size else ""


def _headline(line: Headline) -> Text:
    text = Text(f"  {line.name:<8} ")
    text.append(f"{line.value}{line.unit}", style="bold")
    if line.sigma != UNKNOWN:
        text.append(f" ± {line.sigma}{line.unit}" + (f" ({line.fine})" if line.fine else ""))
    if line.error:
        text.append(f"   error {line.error}", style="" if line.trusted else TONES["bad"])
    return text


def print_table(console: Console, title: str, content: Table) -> None:
    """Nothing of an empty one."""
    if not content.rows:
        return
    shown = RichTable(
        title=title, title_justify="left", title_style="bold", box=None, pad_edge=False, padding=(0, 2, 0, 0)
    )
    for column, head in enumerate(content.head):
        justify: Literal["left", "right"] = "right" if column in content.numeric else "left"
        last = column == len(content.head) - 1
        shown.add_column(Text(head, style="dim"), justify=justify, no_wrap=not last, overflow="fold")
    for row in content.rows:
        shown.add_row(*(Text(cell.text, style=TONES.get(cell.tone, "")) for cell in row))
    console.print()
    console.print(shown)
    if content.note:
        console.print(Text(content.note, style="dim"))
