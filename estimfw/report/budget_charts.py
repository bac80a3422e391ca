"""An error budget as stacked shares over time."""

from __future__ import annotations

import numpy as np

from estimfw.data.record import FloatArray
from estimfw.report.budget_tables import shown_quantities
from estimfw.report.palette import SERIES, SOFT
from estimfw.report.panel import Band, Chart, Curve, Panel
from estimfw.report.timescale import TimeScale
from estimfw.run.budget import Budget

__all__ = ["budget_charts"]

PANELS = 6
"""Panels of one chart."""


def budget_charts(budget: Budget) -> tuple[Chart, ...]:
    """Stacked shares of the mean square error, and the sigmas that they are shares of."""
    shown = list(shown_quantities(budget))
    named = _named(budget, shown)
    scale = TimeScale.of(budget.time)
    time = scale.of_seconds(budget.time)
    charts = []
    for part, start in enumerate(range(0, len(shown), PANELS)):
        own = shown[start : start + PANELS]
        tail = f"_{part + 1}" if part else ""
        stacked = tuple(_stacked(budget, i, named, time) for i in own)
        charts.append(Chart(f"shares{tail}", "shares", "What the errors come from", scale.unit, stacked, SHARES))
        sigmas = tuple(p for p in (_sigmas(budget, i, time) for i in own) if not p.is_blank())
        charts.append(Chart(f"sigmas{tail}", "sigmas", "Sigma: honest and own", scale.unit, sigmas))
    return tuple(chart for chart in charts if chart.panels)


SHARES = "Shares of the mean square error; 100 % is the square of the honest sigma."


def _named(budget: Budget, shown: list[int]) -> list[int]:
    """The sources that get a colour: those with the largest share anywhere, at any time."""
    most = budget.shares[:, :, shown].max(axis=(0, 2), initial=0.0)
    order = [int(s) for s in np.argsort(-most, kind="stable") if most[s] > 0.01]
    return order[: len(SERIES)]


def _stacked(budget: Budget, quantity: int, named: list[int], time: FloatArray) -> Panel:
    shares = 100.0 * budget.shares[:, :, quantity]
    lower, bands = np.zeros(len(time)), []
    for s, colour in zip(named, SERIES, strict=False):
        upper = lower + shares[:, s]
        bands.append(Band(budget.sources[s].name, time, lower, upper, f"{colour}b0"))
        lower = upper
    if len(named) < sum(bool(np.any(budget.shares[:, s] > 1e-4)) for s in range(len(budget.sources))):
        bands.append(Band("other", time, lower, np.minimum(shares.sum(axis=1), 100.0), f"{SOFT}40"))
    return Panel(budget.quantities[quantity], "%", (), tuple(bands), view=(0.0, 100.0))


def _sigmas(budget: Budget, quantity: int, time: FloatArray) -> Panel:
    scale = budget.scales[quantity]
    honest, own = (np.where(v > 0.0, v, np.nan)[:, quantity] * scale for v in (budget.total, budget.own))
    curves = (Curve("honest", time, honest, SERIES[0]), Curve("own", time, own, SERIES[1], "dashed"))
    return Panel(budget.quantities[quantity], budget.units[quantity], curves, logarithmic=True)
