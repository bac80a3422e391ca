"""A symmetric matrix over states as colours, 0 to 1, with a border around each group of them."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import Any

from estimfw.data.record import FloatArray
from estimfw.report.heat_map import COLOURS

__all__ = ["BORDER", "NUMBERED", "MatrixMap", "matrix_map_figure", "matrix_map_height", "written"]

CELL, HEAD, FOOT, SCALE = 26, 16, 110, 84
"""Pixels: of a state, above the first, of the names below the last, and of the colour scale at the right."""

LEAST, MOST = 260, 860
"""Pixels of the matrix."""

NUMBERED = 14
"""The most states whose cells have their numbers in them."""

BORDER = "#d55e00"


@dataclass(frozen=True, slots=True)
class MatrixMap:
    """``values`` (n, n) of ``labels`` (n,), each 0 to 1; groups of them end before ``ends``; ``scale`` says what they are."""

    key: str
    title: str
    labels: tuple[str, ...]
    values: FloatArray
    ends: tuple[int, ...]
    scale: str
    note: str = ""

    @property
    def squares(self) -> tuple[tuple[int, int], ...]:
        """Where each group begins and ends."""
        return tuple(zip((0, *self.ends[:-1]), self.ends, strict=True))


def written(value: float) -> str:
    """A number of a cell: two decimals, ``1`` where that rounds to it, nothing where it rounds to zero."""
    text = f"{value:.2f}"
    return "1" if text == "1.00" else "" if text == "0.00" else text.removeprefix("0")


def matrix_map_height(matrix: MatrixMap) -> int:
    """Pixels that the figure takes on the page."""
    return HEAD + FOOT + max(LEAST, min(MOST, CELL * len(matrix.labels)))


def matrix_map_figure(matrix: MatrixMap) -> dict[str, Any]:
    """The matrix as a plotly figure, a plain dict."""
    names, numbered = [escape(label) for label in matrix.labels], len(matrix.labels) <= NUMBERED
    trace: dict[str, Any] = {
        "type": "heatmap",
        "x": names,
        "y": names,
        "z": [[float(f"{v:.4g}") for v in row] for row in matrix.values.tolist()],
        "hovertemplate": f"%{{y}}, %{{x}}: %{{z:.3g}}<extra>{escape(matrix.scale)}</extra>",
        "zmin": 0,
        "zmax": 1,
        "colorscale": [[i / (len(COLOURS) - 1), colour] for i, colour in enumerate(COLOURS)],
        "colorbar": {"title": {"text": escape(matrix.scale)}, "thickness": 14, "outlinewidth": 0},
    }
    if numbered:
        trace |= {"text": [[written(v) for v in row] for row in matrix.values.tolist()], "texttemplate": "%{text}"}
    axis = {"type": "category", "showgrid": False, "automargin": True, **({"dtick": 1} if numbered else {})}
    layout = {
        "height": matrix_map_height(matrix),
        "margin": {"l": 20, "r": SCALE, "t": HEAD, "b": FOOT},
        "xaxis": {**axis, "tickangle": -50},
        "yaxis": {**axis, "autorange": "reversed"},
        "shapes": [_square(*ends) for ends in matrix.squares],
    }
    return {"data": [trace], "layout": layout}


def _square(first: int, end: int) -> dict[str, Any]:
    low, high = first - 0.5, end - 0.5
    return {"type": "rect", "x0": low, "x1": high, "y0": low, "y1": high, "line": {"color": BORDER, "width": 2.5}}
