"""A matrix over states as a PNG file."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from estimfw.report.heat_map import COLOURS
from estimfw.report.matrix_map import BORDER, NUMBERED, MatrixMap, written
from estimfw.report.pictures import DOTS_PER_INCH, STYLE

__all__ = ["draw_matrix", "save_matrix"]

CELL, HEAD, SCALE, CHARACTER = 0.42, 0.42, 0.95, 0.078
"""Inches: of a state, above the matrix, of the colour scale at its right, and of a character of the longest name."""

LARGEST = 7.0
"""Inches of the matrix."""

NAMED = 60
"""The most states that have their names; of more, only every second one, and so on."""


def save_matrix(matrix: MatrixMap, path: Path) -> None:
    """Write it. Raises OSError where that fails."""
    with matplotlib.rc_context(STYLE):
        figure = draw_matrix(matrix)
        FigureCanvasAgg(figure)
        figure.savefig(path, format="png", dpi=DOTS_PER_INCH)


def draw_matrix(matrix: MatrixMap) -> Figure:
    """The matrix as a matplotlib figure (no pyplot, so that nothing global stays behind)."""
    n = len(matrix.labels)
    side = min(LARGEST, max(2.4, CELL * n))
    names = 0.2 + CHARACTER * max(map(len, matrix.labels), default=0)
    width, height = names + side + SCALE, HEAD + side + names
    figure = Figure(figsize=(width, height))
    figure.suptitle(matrix.title, x=0.1 / width, y=1 - 0.08 / height, ha="left", va="top", fontweight="bold")
    axes = figure.add_axes((names / width, names / height, side / width, side / height))
    colours = LinearSegmentedColormap.from_list("cividis of the page", list(COLOURS))
    image = axes.imshow(matrix.values, vmin=0.0, vmax=1.0, cmap=colours, aspect="equal", interpolation="nearest")
    _name(axes, matrix)
    for first, end in matrix.squares:
        corner, size = (first - 0.5, first - 0.5), end - first
        axes.add_patch(Rectangle(corner, size, size, fill=False, edgecolor=BORDER, linewidth=2.0, clip_on=False))
    if n <= NUMBERED:
        _number(axes, matrix)
    bar = figure.add_axes(((names + side + 0.15) / width, names / height, 0.13 / width, side / height))
    figure.colorbar(image, cax=bar, label=matrix.scale)
    return figure


def _name(axes: Axes, matrix: MatrixMap) -> None:
    step = -(-len(matrix.labels) // NAMED)
    at = np.arange(0, len(matrix.labels), step)
    size = min(9.0, 400.0 / len(matrix.labels) * step)
    shown = [matrix.labels[i].replace("$", r"\$") for i in at]
    axes.set_xticks(at, shown, rotation=90, fontsize=size)
    axes.set_yticks(at, shown, fontsize=size)
    axes.grid(visible=False)
    axes.tick_params(length=2)


def _number(axes: Axes, matrix: MatrixMap) -> None:
    for (i, j), value in np.ndenumerate(matrix.values):
        colour = "#000000" if value > 0.55 else "#ffffff"
        axes.text(j, i, written(float(value)), ha="center", va="center", fontsize=8, color=colour)
