"""Estimates and sigmas of several filters on top of each other, state by state, with the truth where it is known."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from estimfw.report.numbers import significant
from estimfw.report.palette import ROLES, SERIES
from estimfw.report.panel import Chart, Curve, Panel, focused, thinned
from estimfw.report.price_apart import apart_from_first, common_states
from estimfw.report.price_charts import chart_note, curve_names, pieces
from estimfw.report.series import Series, series_of
from estimfw.report.timescale import TimeScale
from estimfw.run.compare import Comparison

__all__ = ["overlay_charts"]

SHOWN = "Dashed over solid: filters that agree cover each other."
SAME = "{names} and {first} are one filter: they differ by {most} σ at most."


def overlay_charts(comparison: Comparison, limit: int) -> tuple[Chart, ...]:
    """Estimates, then sigmas, of the states that the first filter shares with another one; at the first point of the grid.

    ``limit`` is the most points of a curve. Nothing where there is one filter, or something is varied.
    """
    results = comparison.results[0]
    if len(comparison.points) > 1 or len(results) < 2:
        return ()
    scale = TimeScale.of(results[0]["time"].to_numpy())
    found = [_found(comparison, label) for label in common_states(results)]
    every = {
        "estimates": ("Estimates and truth", [_estimates(one, comparison, scale, limit) for one in found]),
        "sigmas": ("Standard deviations", [_sigmas(one, comparison, scale, limit) for one in found]),
    }
    charts = []
    for key, (title, panels) in every.items():
        for i, cut in enumerate(pieces([p for p in panels if not p.is_blank()])):
            note = f"{SHOWN} {_same(comparison)}{chart_note(comparison, cut)}".strip()
            number = f"_{i + 1}" if i else ""
            charts.append(Chart(f"{key}{number}", "overlays", title, scale.unit, tuple(cut), note))
    return tuple(charts)


def _same(comparison: Comparison) -> str:
    """Which filters' curves coincide with those of the first."""
    rows = [one for one in apart_from_first(comparison) if one.same]
    if not rows:
        return ""
    most = max(max(one.estimate, one.sigma) for one in rows)
    names = ", ".join(one.filter for one in rows)
    return SAME.format(names=names, first=comparison.filters[0].name, most=significant(most, 1)) + " "


def _found(comparison: Comparison, label: str) -> list[tuple[int, Series]]:
    """Which filters have this state, and its columns."""
    results = comparison.results[0]
    return [(i, s) for i, result in enumerate(results) for s in series_of(result, "state") if s.label == label]


def _curves(
    found: Sequence[tuple[int, Series]], comparison: Comparison, scale: TimeScale, which: str, limit: int
) -> Iterator[Curve]:
    names = curve_names(comparison)
    for i, series in found:
        time, values = scale.of_seconds(series.dataset["time"].to_numpy()), getattr(series, which)
        time, (values,) = thinned(time, (values,), limit)
        yield Curve(names[i], time, values, SERIES[i % len(SERIES)], "dashed" if i else "line")


def _estimates(found: list[tuple[int, Series]], comparison: Comparison, scale: TimeScale, limit: int) -> Panel:
    _, first = found[0]
    curves = list(_curves(found, comparison, scale, "value", limit))
    if np.isfinite(first.truth).any():
        time, (truth,) = thinned(scale.of_seconds(first.dataset["time"].to_numpy()), (first.truth,), limit)
        curves.append(Curve("truth", time, truth, ROLES["truth"], "dotted"))
    view = focused(*((c.time, c.values) for c in curves))
    return Panel(first.label, first.unit, tuple(curves), view=view)


def _sigmas(found: list[tuple[int, Series]], comparison: Comparison, scale: TimeScale, limit: int) -> Panel:
    _, first = found[0]
    curves = []
    for one in _curves(found, comparison, scale, "sigma", limit):
        values = np.where(one.values > 0.0, one.values, np.nan)
        curves.append(Curve(one.name, one.time, values, one.colour, one.style))
    return Panel(f"σ of {first.label}", first.unit, tuple(curves), logarithmic=True)
