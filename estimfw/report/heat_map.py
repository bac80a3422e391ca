"""States against time, the colour telling how much of each prior sigma is left."""

from __future__ import annotations

import math
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from estimfw.data.record import FloatArray

__all__ = ["HeatMap", "heat_map_figure", "heat_map_height"]

ROW, HEAD, FOOT, SCALE = 24, 20, 52, 84
"""Pixels: of a state, above the first, of the time axis below the last, and of the colour scale at the right."""

DECADES = 4
"""Powers of ten below 1 that the colours tell apart."""

COLUMNS = 240
"""The most instants that are drawn."""

COLOURS = ("#00224e", "#31446b", "#666970", "#958f78", "#cbba69", "#fee838")
"""Cividis (Nunez, Anderton and Renslow, PLOS ONE 13, 2018), which does not depend on colour vision: dark is well known."""


@dataclass(frozen=True, slots=True)
class HeatMap:
    """``values`` (T, n) of ``rows`` (n,) over ``time`` (T,) in ``time_unit``; NaN is a gap."""

    key: str
    title: str
    rows: tuple[str, ...]
    time: FloatArray
    time_unit: str
    values: FloatArray
    note: str = ""


def heat_map_height(heat: HeatMap) -> int:
    """Pixels that the figure takes on the page."""
    return HEAD + FOOT + max(160, ROW * len(heat.rows))


def heat_map_figure(heat: HeatMap) -> dict[str, Any]:
    """The map as a plotly figure, a plain dict: logarithmic colours, 1 and more at the bright end."""
    own = np.unique(np.linspace(0, heat.time.size - 1, min(heat.time.size, COLUMNS)).round().astype(int))
    values = heat.values[own].T
    low = _lowest(values)
    ticks = list(range(low, 1))
    trace = {
        "type": "heatmap",
        "x": [float(f"{t:.6g}") for t in heat.time[own]],
        "y": [escape(row) for row in heat.rows],
        "z": [[_number(math.log10(v)) if v > 0.0 else None for v in row] for row in values.tolist()],
        "customdata": [[_number(v) for v in row] for row in values.tolist()],
        "hovertemplate": f"%{{y}}, %{{x}} {heat.time_unit}: %{{customdata}}<extra></extra>",
        "zmin": low,
        "zmax": 0,
        "colorscale": [[i / (len(COLOURS) - 1), colour] for i, colour in enumerate(COLOURS)],
        "colorbar": {
            "title": {"text": "sigma /<br>prior sigma"},
            "tickvals": ticks,
            "ticktext": [f"{10.0**tick:g}" for tick in ticks],
            "thickness": 14,
            "outlinewidth": 0,
        },
    }
    layout = {
        "height": heat_map_height(heat),
        "margin": {"l": 20, "r": SCALE, "t": HEAD, "b": FOOT},
        "xaxis": {"title": {"text": f"time, {heat.time_unit}"}, "showgrid": False, "zeroline": False},
        "yaxis": {"autorange": "reversed", "automargin": True, "showgrid": False, "type": "category", "dtick": 1},
    }
    return {"data": [trace], "layout": layout}


def _lowest(values: FloatArray) -> int:
    positive = values[np.isfinite(values) & (values > 0.0)]
    return max(-DECADES, min(-1, math.floor(math.log10(positive.min())))) if positive.size else -1


def _number(value: float) -> float | None:
    return float(f"{value:.3g}") if math.isfinite(value) else None
