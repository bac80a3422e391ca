"""Charts as PNG files, for slides and papers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from estimfw.report.palette import INK
from estimfw.report.panel import Band, Chart, Curve, Panel

__all__ = ["draw", "save_picture"]

WIDTH, ROW, HEAD = 9.0, 2.1, 0.9
"""Inches: of a picture, of one panel in it, and of its title."""

DOTS_PER_INCH = 150

STYLE: dict[Any, object] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.edgecolor": "#8a929b",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 6),
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

DASHES: dict[str, str] = {"line": "-", "dashed": "--", "dots": "none", "crosses": "none"}
MARKS: dict[str, str] = {"line": "none", "dashed": "none", "dots": ".", "crosses": "x"}


def save_picture(chart: Chart, path: Path) -> None:
    """Write one chart as a PNG. Raises OSError where that fails."""
    with matplotlib.rc_context(STYLE):
        figure = draw(chart)
        figure.savefig(path, format="png", dpi=DOTS_PER_INCH)


def draw(chart: Chart) -> Figure:
    """The chart as a matplotlib figure (no pyplot, so that nothing global stays behind)."""
    rows = len(chart.panels)
    figure = Figure(figsize=(WIDTH, HEAD + ROW * rows + (ROW if rows == 1 else 0)), layout="constrained")
    figure.suptitle(_text(chart.title), x=0.012, ha="left", fontsize=12, fontweight="bold")
    all_axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(all_axes, chart.panels, strict=True):
        _draw_panel(axes, panel)
    all_axes[-1].set_xlabel(f"time, {chart.time_unit}")
    figure.align_ylabels(list(all_axes))
    _draw_legend(figure, chart, list(all_axes))
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    if panel.logarithmic:
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(LogFormatter(labelOnlyBase=False))
        axes.yaxis.set_minor_formatter(LogFormatter(labelOnlyBase=False, minor_thresholds=(1.2, 0.4)))
    for band in panel.bands:
        _draw_band(axes, band)
    for curve in panel.curves:
        _draw_curve(axes, curve)
    axes.set_title(_text(panel.title), loc="left", fontsize=9.5, color=INK)
    axes.set_ylabel(_text(panel.unit))
    axes.margins(x=0.01)
    if panel.view:
        axes.set_ylim(*panel.view)


def _draw_band(axes: Axes, band: Band) -> None:
    axes.fill_between(band.time, band.lower, band.upper, color=band.colour, linewidth=0, label=band.name)
    for edge in (band.lower, band.upper):
        axes.plot(band.time, edge, color=band.colour[:7], alpha=0.55, linewidth=0.7)


def _draw_curve(axes: Axes, curve: Curve) -> None:
    alone = curve.style in ("line", "dashed") and np.isfinite(curve.values).sum() == 1
    axes.plot(
        curve.time,
        curve.values,
        color=curve.colour,
        linestyle=DASHES[curve.style],
        marker="o" if alone else MARKS[curve.style],
        markersize=4.5 if alone or curve.style == "crosses" else 2.5,
        label=_text(curve.name),
    )


def _draw_legend(figure: Figure, chart: Chart, all_axes: list[Axes]) -> None:
    """One legend for the chart where its panels show the same things, else one in each panel."""
    names = {tuple(curve.name for curve in panel.curves) for panel in chart.panels}
    if len(names) > 1:
        for axes in all_axes:
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return
    handles, labels = all_axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))


def _text(words: str) -> str:
    """Labels are words: a dollar sign in one begins no formula."""
    return words.replace("$", r"\$")
