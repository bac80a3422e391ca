"""Charts as PNG files, for slides and papers."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from PIL import Image

from estimfw.report.palette import INK, SOFT
from estimfw.report.panel import Band, Chart, Curve, Panel
from estimfw.report.ticks import LinearLabels, LogLabels, log_locator

__all__ = ["draw", "save_picture"]

WIDTH, ROW, HEAD, FOOT, GAP, RIGHT = 9.0, 1.6, 0.64, 0.48, 0.42, 0.15
"""Inches: of a picture, of one pair of axes, above and below all of them, between them (their titles), at their right.

Places are computed from these; matplotlib's layout engines draw everything twice to find them.
"""

LABEL, CHARACTER = 0.42, 0.076
"""Inches at the left: for the unit and the ticks, and for each character of the longest tick label."""

LEGEND_ROW, KEY, TITLE = 0.2, 0.55, 0.24
"""Inches: of a row of a legend that stands above the title of its panel, of a key in it, and of that title."""

LINE, CHARACTERS = 0.14, 160
"""Inches and characters of a line of the note below the title."""

DOTS_PER_INCH = 150
COMPRESSION = 4
"""Of zlib: files a hundredth larger than at the default 6, in less time; so does leaving out the alpha channel."""

STYLE: dict[Any, object] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.edgecolor": "#8a929b",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#dfe3e8",
    "grid.linewidth": 0.6,
    "xtick.color": "#57606a",
    "ytick.color": "#57606a",
    "text.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.3,
}

MARK = "#868e96"

DASHES: dict[str, str] = {"line": "-", "dashed": "--", "dotted": ":", "dots": "none", "crosses": "none"}
MARKS: dict[str, str] = {"line": "none", "dashed": "none", "dotted": "none", "dots": ".", "crosses": "x"}


def save_picture(chart: Chart, path: Path) -> None:
    """Write one chart as a PNG. Raises OSError where that fails."""
    with matplotlib.rc_context(STYLE):
        canvas = FigureCanvasAgg(draw(chart))
        canvas.figure.set_dpi(DOTS_PER_INCH)
        canvas.draw()
    pixels = Image.fromarray(np.asarray(canvas.buffer_rgba())[:, :, :3])
    pixels.save(path, format="png", dpi=(DOTS_PER_INCH, DOTS_PER_INCH), compress_level=COMPRESSION)


def draw(chart: Chart) -> Figure:
    """The chart as a matplotlib figure (no pyplot, so that nothing global stays behind)."""
    rows = len(chart.panels)
    row = ROW * 2 if rows == 1 else ROW
    told = textwrap.wrap(chart.note, CHARACTERS)
    above = _legend_rows(chart.panels[0]) if _is_wide(chart.panels[0]) else 0
    head = HEAD + LINE * len(told) + LEGEND_ROW * above
    height = head + FOOT + rows * row + (rows - 1) * GAP
    figure = Figure(figsize=(WIDTH, height))
    figure.suptitle(_text(chart.title), x=0.1 / WIDTH, y=1 - 0.08 / height, ha="left", va="top", fontweight="bold")
    figure.text(0.1 / WIDTH, 1 - 0.29 / height, _text("\n".join(told)), va="top", fontsize=7.5, color=SOFT)
    all_axes: list[Axes] = []
    for panel in chart.panels:
        axes = figure.add_subplot(rows, 1, len(all_axes) + 1, sharex=all_axes[0] if all_axes else None)
        _draw_panel(axes, panel)
        axes.tick_params(labelbottom=panel is chart.panels[-1])
        all_axes.append(axes)
    all_axes[-1].set_xlabel(chart.horizontal)
    if chart.across:
        all_axes[-1].set_aspect("equal", adjustable="datalim")
    _draw_marks(chart, all_axes)
    if chart.over:
        all_axes[-1].set_xscale("log")
        all_axes[-1].xaxis.set_major_formatter(LogLabels())
    if chart.over:
        all_axes[-1].set_xscale("log")
    if chart.span:
        all_axes[-1].set_xlim(*chart.span)
    _place(all_axes, row, head, height)
    _draw_legends(chart, all_axes, row)
    return figure


def _draw_marks(chart: Chart, all_axes: list[Axes]) -> None:
    """A line through all panels, and its name in the first one."""
    for begin, name in chart.marks:
        for axes in all_axes:
            axes.axvline(begin, color=MARK, linewidth=0.8, linestyle=":")
        all_axes[0].annotate(
            _text(name), (begin, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -2), textcoords="offset points",
            va="top", fontsize=7.5, color=MARK,
        )  # fmt: skip


def _place(all_axes: list[Axes], row: float, head: float, height: float) -> None:
    """Axes one below the other, all with the room at the left that the longest tick label needs."""
    left = LABEL + CHARACTER * max(len(label) for axes in all_axes for label in _tick_labels(axes))
    width = WIDTH - left - RIGHT
    for place, axes in enumerate(all_axes):
        top = head + place * (row + GAP)
        axes.set_position((left / WIDTH, 1 - (top + row) / height, width / WIDTH, row / height))
        axes.yaxis.set_label_coords(-(left - 0.17) / width, 0.5)
        axes.xaxis.set_label_coords(0.5, -0.29 / row)


def _tick_labels(axes: Axes) -> list[str]:
    low, high = sorted(axes.get_ylim())
    return axes.yaxis.get_major_formatter().format_ticks([v for v in axes.get_yticks() if low <= v <= high]) or [""]


def _draw_panel(axes: Axes, panel: Panel) -> None:
    if panel.logarithmic:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(log_locator(panel.decades))
        axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(LogLabels() if panel.logarithmic else LinearLabels())
    for band in panel.bands:
        _draw_band(axes, band)
    for curve in panel.curves:
        _draw_curve(axes, curve, on_top=panel.logarithmic and curve.style in ("dashed", "dotted"))
    axes.set_title(_text(panel.title), loc="left", y=1.0, fontsize=9.5, color=INK)
    axes.set_ylabel(_text(panel.unit))
    axes.margins(x=0.01)
    if panel.view:
        axes.set_ylim(*panel.view)


def _draw_band(axes: Axes, band: Band) -> None:
    axes.fill_between(band.time, band.lower, band.upper, color=band.colour, linewidth=0, label=band.name)
    for edge in (band.lower, band.upper):
        axes.plot(band.time, edge, color=band.colour[:7], alpha=0.55, linewidth=0.7)


def _draw_curve(axes: Axes, curve: Curve, *, on_top: bool) -> None:
    """``on_top``: sigmas that are equal lie on each other, and a line shows between the dashes of another."""
    alone = curve.style in ("line", "dashed", "dotted") and np.isfinite(curve.values).sum() == 1
    axes.plot(
        curve.time,
        curve.values,
        color=curve.colour,
        linestyle=DASHES[curve.style],
        marker="o" if alone else MARKS[curve.style],
        markersize=4.5 if alone or curve.style == "crosses" else 2.5,
        label=_text(curve.name) if curve.listed else "_",
        zorder=2.1 if on_top else 2.0,
    )


def _draw_legends(chart: Chart, all_axes: list[Axes], row: float) -> None:
    """Beside the title of the first panel, and of each other one that shows other things."""
    shown: tuple[str, ...] = ()
    for axes, panel in zip(all_axes, chart.panels, strict=True):
        names = _legend_names(panel)
        if names != shown and names != (panel.title,):
            wide = _is_wide(panel)
            columns = -(-len(names) // _legend_rows(panel)) if wide else len(names)
            up = 1.0 + (TITLE / row if wide else 0.0)
            legend = axes.legend(loc="lower right", bbox_to_anchor=(1.0, up), ncols=columns, borderaxespad=0)
            legend.set_in_layout(False)
        shown = shown or names


def _legend_names(panel: Panel) -> tuple[str, ...]:
    return (*(band.name for band in panel.bands), *(curve.name for curve in panel.curves if curve.listed))


def _legend_width(panel: Panel) -> float:
    """Inches of the legend in one row."""
    return sum(KEY + CHARACTER * len(name) for name in _legend_names(panel))


def _is_wide(panel: Panel) -> bool:
    """The legend does not fit beside the title: it goes above it."""
    return _legend_width(panel) + CHARACTER * len(panel.title) > WIDTH - LABEL - RIGHT - 0.5


def _legend_rows(panel: Panel) -> int:
    return max(1, -(-int(10 * _legend_width(panel)) // int(10 * (WIDTH - LABEL - RIGHT - 0.8))))


def _text(words: str) -> str:
    """Labels are words: a dollar sign in one begins no formula."""
    return words.replace("$", r"\$")
