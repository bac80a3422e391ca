"""A way over ground as a map: outputs ``NAME.east`` and ``NAME.north`` of one unit, to one scale, with where it really went."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from estimfw.data.record import FloatArray
from estimfw.report.palette import ROLES
from estimfw.report.panel import Chart, Curve, Panel, slug, thinned
from estimfw.report.series import series_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["track_charts"]


def track_charts(dataset: xr.Dataset, limit: int) -> Iterator[Chart]:
    """A map for each pair of outputs that is one."""
    series = {one.label: one for one in series_of(dataset, "output")}
    for label, east in series.items():
        north = series.get(f"{east.group}.north")
        if label != f"{east.group}.east" or north is None or north.unit != east.unit:
            continue
        curves = [_curve("estimate", east.value, north.value, limit)]
        if np.isfinite(east.truth).any() and np.isfinite(north.truth).any():
            curves.append(_curve("truth", east.truth, north.truth, limit))
        panel = Panel(east.group, f"north, {north.unit}", tuple(curves))
        title = f"{east.group[:1].upper()}{east.group[1:]} over ground"
        yield Chart(f"map_{slug(east.group)}", "outputs", title, "", (panel,), across=f"east, {east.unit}")


def _curve(name: str, east: FloatArray, north: FloatArray, limit: int) -> Curve:
    _, (east, north) = thinned(np.arange(east.size, dtype=float), (east, north), limit)
    return (
        Curve(name, east, north, ROLES["value"])
        if name == "estimate"
        else Curve(name, east, north, ROLES["truth"], "dashed")
    )
