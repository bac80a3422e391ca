"""The errors of several filters over time, in one picture."""

from __future__ import annotations

import numpy as np

from estimfw.report.palette import SERIES
from estimfw.report.panel import Chart, Curve, Panel, focused, slug, thinned
from estimfw.report.series import Series, series_of
from estimfw.report.timescale import TimeScale
from estimfw.run.compare import Comparison

__all__ = ["chart_note", "curve_names", "pieces", "price_charts"]

#: Panels of one chart, and characters of its legend; longer names are told below the title, by number.
MOST = 6
LEGEND = 80
NOTE = "Vertical axes leave out how the run starts where that would hide its end."


def price_charts(comparison: Comparison, limit: int) -> tuple[Chart, ...]:
    """One chart of all outputs; where something is varied, one for each output with a panel for each point.

    Errors where truth is known, values elsewhere. ``limit`` is the most points of a curve.
    """
    first = comparison.results[0][0]
    labels = [s.label for s in _series(comparison, 0, 0)]
    scale = TimeScale.of(first["time"].to_numpy())
    varied = len(comparison.points) > 1
    if not varied:
        panels = [_panel(comparison, 0, label, label, scale, limit) for label in labels]
        return tuple(
            Chart(
                f"errors{_number(i)}",
                "errors",
                f"{_what(comparison)} over time",
                scale.unit,
                tuple(cut),
                chart_note(comparison, cut),
            )
            for i, cut in enumerate(pieces([p for p in panels if not p.is_blank()]))
        )
    charts = []
    for label in labels:
        points = range(len(comparison.points))
        panels = [_panel(comparison, i, label, comparison.points[i].label, scale, limit) for i in points]
        for i, cut in enumerate(pieces([p for p in panels if not p.is_blank()])):
            title = f"{_what(comparison)} of {label} over time"
            charts.append(
                Chart(
                    f"{slug(label)}{_number(i)}", "errors", title, scale.unit, tuple(cut), chart_note(comparison, cut)
                )
            )
    return tuple(charts)


def _series(comparison: Comparison, point: int, index: int) -> tuple[Series, ...]:
    result = comparison.results[point][index]
    return series_of(result, "output") or series_of(result, "state")


def _what(comparison: Comparison) -> str:
    return "Errors" if _known(comparison) else "Values"


def _known(comparison: Comparison) -> bool:
    return any(np.isfinite(s.error).any() for s in _series(comparison, 0, 0))


def _panel(comparison: Comparison, point: int, label: str, title: str, scale: TimeScale, limit: int) -> Panel:
    known, names, curves, unit = _known(comparison), curve_names(comparison), [], ""
    for i in range(len(comparison.filters)):
        for series in _series(comparison, point, i):
            if series.label != label:
                continue
            time = scale.of_seconds(series.dataset["time"].to_numpy())
            time, (values,) = thinned(time, (series.error if known else series.value,), limit)
            # Filters that agree lie on each other: a dashed curve leaves the one below it to be seen.
            curves.append(Curve(names[i], time, values, SERIES[i % len(SERIES)], "dashed" if i else "line"))
            unit = series.unit
    return Panel(title, unit, tuple(curves), view=focused(*((c.time, c.values) for c in curves)))


def pieces(panels: list[Panel]) -> list[list[Panel]]:
    """So many panels a chart as can be read."""
    return [panels[i : i + MOST] for i in range(0, len(panels), MOST)]


def _number(i: int) -> str:
    return f"_{i + 1}" if i else ""


def curve_names(comparison: Comparison) -> list[str]:
    """Of the filters, for a legend: numbers where the names are too long."""
    names = [one.name for one in comparison.filters]
    if sum(map(len, names)) <= LEGEND:
        return names
    return [f"{i}" for i in range(len(names))]


def chart_note(comparison: Comparison, panels: list[Panel]) -> str:
    """What the axes leave out, and which filter a number in the legend stands for."""
    told = [NOTE] if any(p.view for p in panels) else []
    short, names = curve_names(comparison), [one.name for one in comparison.filters]
    if short != names:
        pairs = (n if n.startswith(f"{s} ") else f"{s}: {n}" for s, n in zip(short, names, strict=True))
        told.append(f"Curves: {', '.join(pairs)}.")
    return " ".join(told)
