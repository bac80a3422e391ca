"""The nodes of a decentralised filter for people: what each owns, and what it sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from estimfw.report.brief_labels import brief_labels
from estimfw.report.numbers import count, plain
from estimfw.report.tables import Cell, Table
from estimfw.run.summary import json_attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["node_table"]

HEAD = ("node", "states", "measurements", "messages a step", "words a step", "silent steps")
FORMS = {
    "exact": "Together the nodes are one filter: estimates and sigmas are those of the global one, whatever the cut.",
    "drop": "No covariance between nodes is kept: this is not the global filter, and its own sigmas do not know it.",
    "decoupled": "Each node is a filter alone: this is not the global filter, and its own sigmas do not know it.",
}


def node_table(dataset: xr.Dataset) -> Table:
    """No rows where the filter has no nodes."""
    exchange = json_attribute(dataset, "exchange", None)
    if not exchange:
        return Table(HEAD, ())
    steps = max(1, int(exchange["steps"]))
    away = any(node["silent_steps"] for node in exchange["nodes"])
    states = [str(label) for label in dataset["state"].to_numpy()]
    rows = tuple(_row(node, steps, states)[: len(HEAD) - (not away)] for node in exchange["nodes"])
    note = (
        f"{FORMS[exchange['cross_covariance']]} {_mean(exchange['words'], steps)} words (numbers) a step in "
        f"{_mean(exchange['rounds'], steps)} rounds, each of which waits for all nodes."
    )
    return Table(HEAD[: len(HEAD) - (not away)], rows, frozenset({3, 4, 5}), note)


def _row(node: dict[str, Any], steps: int, states: list[str]) -> tuple[Cell, ...]:
    words = sum(node["words"].values())
    return (
        Cell(node["name"]),
        Cell(brief_labels(node["states"], states)),
        Cell(", ".join(node["measurements"]) or "none"),
        Cell(_mean(node["messages"], steps)),
        Cell(_mean(words, steps)),
        Cell(count(node["silent_steps"]), "warn" if node["silent_steps"] else ""),
    )


def _mean(total: int, steps: int) -> str:
    """A step's part of a count."""
    value = total / steps
    return count(round(value)) if value >= 1000 or total % steps == 0 else plain(value)
