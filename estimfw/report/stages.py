"""Stages of an estimation, in tables and in pictures."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from estimfw.report.numbers import UNKNOWN, instant
from estimfw.report.tables import Cell, Table
from estimfw.report.timescale import TimeScale
from estimfw.run.summary import json_attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["stage_marks", "stage_table"]

NOTE = (
    "held: believed to be known exactly, with no sigma and no gain; considered: no gain, but their covariance counts. The honest "
    "sigmas are those of the errors on the whole model, through all stages."
)


def stage_table(dataset: xr.Dataset) -> Table:
    """What was believed and measured from when to when; no rows where there are no stages."""
    stages = json_attribute(dataset, "stages", [])
    states = [str(label) for label in dataset["state"].to_numpy()] if stages else []
    rows = []
    for one in stages:
        other = {*one["held"], *one["considered"]}
        rows.append(
            (
                Cell(str(one["name"])),
                Cell(instant(one["begin"])),
                Cell(instant(one["end"])),
                Cell(_named([s for s in states if s not in other], states)),
                Cell(_named(one["held"], states), "warn" if one["held"] else ""),
                Cell(_named(one["considered"], states)),
                Cell("\n".join(one["measurements"]) or UNKNOWN),
            )
        )
    head = ("stage", "from, s", "to, s", "estimated", "held", "considered", "measured")
    return Table(head, tuple(rows), frozenset({1, 2}), NOTE if rows else "")


def stage_marks(dataset: xr.Dataset, scale: TimeScale) -> tuple[tuple[float, str], ...]:
    """Where each stage begins, in the unit of the time axis, and its name."""
    return tuple((one["begin"] / scale.seconds, str(one["name"])) for one in json_attribute(dataset, "stages", []))


def _named(chosen: Sequence[str], states: Sequence[str]) -> str:
    """Whole blocks by their name, single states by their label."""
    found = list[str]()
    for block, own in groupby(states, key=lambda label: label.partition("[")[0]):
        labels = list(own)
        taken = [label for label in labels if label in chosen]
        found += [block] if taken == labels else taken
    return "\n".join(found) or UNKNOWN
