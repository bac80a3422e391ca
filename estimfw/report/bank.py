"""A bank for people: the reported member in a line, all of them in a table, their weights over time in a picture."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from estimfw.data.record import FloatArray
from estimfw.report.numbers import instant, significant
from estimfw.report.palette import INK, SERIES
from estimfw.report.panel import Chart, Curve, Panel, thinned
from estimfw.report.tables import Cell, Table
from estimfw.report.timescale import TimeScale
from estimfw.run.bank_end import bank_end

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["bank_chart", "bank_line", "bank_table"]

DRAWN = 2 * len(SERIES)
"""Members that a picture can tell apart: in six colours, drawn and dashed."""

BEHIND = 1e4
"""A member that is farther behind than this is at the edge of the picture."""

DOUBT = "Estimate, sigmas and outputs are those of the best member alone: its sigmas know nothing of the doubt between members."
NOTE = f"The weight of a member is the probability that its start is the right one, if one of them is. {DOUBT}"


def bank_line(dataset: xr.Dataset) -> str:
    """The reported member, its weight, and the next one; empty where the result is not that of a bank."""
    end = bank_end(dataset)
    if end is None:
        return ""
    told = (
        f"bank of {len(end.weights)}: {end.member}, weight {_weight(end.weight)}, reported since {instant(end.since)} s"
    )
    others = [(label, weight) for label, weight in end.weights if label != end.member]
    return f"{told}; next {others[0][0]}, {_weight(others[0][1])}" if others else told


def bank_table(dataset: xr.Dataset) -> Table:
    """Members by their weight at the end; no rows where the result is not that of a bank."""
    end = bank_end(dataset)
    head = ("member", "weight", "J above the best")
    if end is None:
        return Table(head, ())
    last = dict(zip((str(m) for m in dataset["member"].to_numpy()), dataset["bank_score"].to_numpy()[-1], strict=True))
    lowest = min(last.values())
    rows = tuple(
        (Cell(label, "good" if label == end.member else ""), Cell(_weight(weight)), Cell(_behind(last[label] - lowest)))
        for label, weight in end.weights
    )
    return Table(head, rows, frozenset({1, 2}), DOUBT if len(rows) > 1 else "")


def _weight(weight: float) -> str:
    return "0" if weight < 1e-99 else significant(weight, 3)


def _behind(difference: float) -> str:
    return significant(difference, 4) if np.isfinite(difference) else "lost"


def bank_chart(dataset: xr.Dataset, scale: TimeScale, limit: int) -> Chart:
    """Weights over time, and how far each member is behind the best; the best of those at the end where there are many."""
    panels = _panels(dataset, scale.of_seconds(dataset["time"].to_numpy()), limit) if "bank_weight" in dataset else ()
    return Chart("bank", "bank", "Bank: weights of its members", scale.unit, panels, NOTE if panels else "")


def _panels(dataset: xr.Dataset, time: FloatArray, limit: int) -> tuple[Panel, ...]:
    end = bank_end(dataset)
    if end is None:
        return ()
    labels = [str(label) for label in dataset["member"].to_numpy()]
    order = [label for label, _ in end.weights if label != end.member][: DRAWN - 1]
    drawn = [i for i, label in enumerate(labels) if label in (end.member, *order)]
    weight, score = dataset["bank_weight"].to_numpy(), dataset["bank_score"].to_numpy()
    behind = np.where(np.isfinite(score), score - np.min(score, axis=1, keepdims=True), np.nan)
    behind = np.where(behind < BEHIND, np.maximum(behind, 0.1), np.nan)
    left = len(labels) - len(drawn)
    title = f"weight{f' ({left} members that are farther behind are not drawn)' if left else ''}"
    return (
        Panel(title, "1", _curves(labels, drawn, weight, time, limit), view=(-0.03, 1.03)),
        Panel(
            "J above that of the best (drawn from 0.1 on)",
            "1",
            _curves(labels, drawn, behind, time, limit),
            logarithmic=True,
        ),
    )


def _curves(labels: list[str], drawn: list[int], values: FloatArray, time: FloatArray, limit: int) -> tuple[Curve, ...]:
    curves = []
    for place, (i, colour) in enumerate(zip(drawn, cycle(SERIES), strict=False)):
        own_time, (own,) = thinned(time, (values[:, i],), limit)
        colour = INK if len(drawn) == 1 else colour
        curves.append(Curve(labels[i], own_time, own, colour, "line" if place < len(SERIES) else "dashed"))
    return tuple(curves)
