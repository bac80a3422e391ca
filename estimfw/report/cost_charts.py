"""Predicted speed-up over the number of states, and over the latency of the link."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from estimfw.analysis.speed_up import Link, equal_cut, speed_up
from estimfw.data.record import FloatArray
from estimfw.report.cost_tables import link_text, speed_text
from estimfw.report.palette import INK, SERIES, SOFT
from estimfw.report.panel import Chart, Curve, Panel
from estimfw.run.cost import CutCost

__all__ = ["cost_charts"]

POINTS = 120
LARGEST = 10_000
SHORTEST, LONGEST = 1e-8, 1e-2


def cost_charts(cut: CutCost) -> tuple[Chart, Chart]:
    """Over states, and over latencies."""
    return _over_states(cut), _over_latency(cut)


def _over_states(cut: CutCost) -> Chart:
    parts, own = len(cut.nodes.names), cut.sizes.states
    share = Fraction(cut.sizes.measured, own)
    states = np.unique(np.geomspace(max(parts, 4), max(LARGEST, 4 * own), POINTS).round().astype(int))
    sizes = [equal_cut(int(n), parts, share) for n in states]
    linked = np.array([speed_up(one, cut.link).ratio for one in sizes])
    free = np.array([speed_up(one, cut.link).without_communication for one in sizes])
    over = states.astype(float)
    curves = (
        Curve("this link", over, linked, SERIES[0]),
        Curve("no communication", over, free, SERIES[2], "dashed"),
        _level(f"limit {cut.largest:.2f}", over, cut.largest, SOFT),
        _level("one processor", over, 1.0, INK),
        Curve("this filter", np.array([float(own)]), np.array([cut.times.ratio]), SERIES[1], "crosses"),
    )
    note = (
        f"{parts} equal nodes, as many rows a state as here; {link_text(cut)}. Above 1 several processors are quicker."
    )
    return Chart(
        "speed_up_states", "speed_up", "Predicted speed-up over the number of states", "", (_panel(curves),), note,
        over="states",
    )  # fmt: skip


def _over_latency(cut: CutCost) -> Chart:
    latency = np.geomspace(SHORTEST, LONGEST, POINTS)
    links = [replace(cut.link, latency=float(one)) for one in latency]
    own: Link = cut.link
    curves = (
        Curve("this filter", latency, np.array([speed_up(cut.sizes, one).ratio for one in links]), SERIES[0]),
        _level("one processor", latency, 1.0, INK),
        Curve("this link", np.array([own.latency]), np.array([cut.times.ratio]), SERIES[1], "crosses"),
    )
    note = f"{cut.sizes.states} states in {len(cut.nodes.names)} nodes; {speed_text(cut)}."
    return Chart(
        "speed_up_latency", "speed_up", "Predicted speed-up over the latency of the link", "", (_panel(curves),), note,
        over="latency, s",
    )  # fmt: skip


def _panel(curves: tuple[Curve, ...]) -> Panel:
    return Panel("time on one processor over time on several", "times quicker", curves, logarithmic=True)


def _level(name: str, over: FloatArray, value: float, colour: str) -> Curve:
    return Curve(name, over, np.full_like(over, value), colour, "dashed")
