"""The charts of a result: outputs, states, errors, sigmas, and for each measurement innovations and NIS."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from estimfw.data.record import FloatArray
from estimfw.report.bank import bank_chart
from estimfw.report.consistency import innovation_chart, nis_chart
from estimfw.report.palette import BAND, BAND_HONEST, BAND_SMOOTHED, ROLES, SERIES
from estimfw.report.panel import Band, Chart, Curve, Panel, Style, focused, slug, thinned
from estimfw.report.series import Axis, Series, grouped, series_of
from estimfw.report.stages import stage_marks
from estimfw.report.timescale import TimeScale
from estimfw.report.track import track_charts
from estimfw.run.result_names import measurement_names

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["charts_of"]

ROWS = 6
"""Panels of one chart: more do not fit on a page."""

FOCUS_NOTE = "Some vertical axes leave out how the run starts, so that its end can be seen."
HONEST_NOTE = "Lines: the filter's own sigmas. Dashed: the honest ones, on the model without its reductions."
SMOOTHED_NOTE = "Lines: the filter's sigmas. Dashed: the smoothed ones, which data after each instant count for too."
ANGLE_NOTE = "Angles are drawn without jumps: a curve may go beyond its range by a whole turn (361 deg is 1 deg)."


def charts_of(dataset: xr.Dataset, limit: int) -> tuple[Chart, ...]:
    """All charts with anything to show, in the order of the report.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.
    limit : int
        The most points of one curve.
    """
    scale = TimeScale.of(dataset["time"].to_numpy())
    charts = [
        *track_charts(dataset, limit),
        *_axis_charts(dataset, "output", scale, limit),
        *_axis_charts(dataset, "state", scale, limit),
        *_sigma_charts(dataset, scale, limit),
        bank_chart(dataset, scale, limit),
    ]
    for name in measurement_names(dataset):
        charts += [innovation_chart(dataset, name, scale, limit), nis_chart(dataset, name, scale, limit)]
    marks = stage_marks(dataset, scale)
    span = _span(scale.of_seconds(dataset["time"].to_numpy()))
    return tuple(
        _distinct(
            chart if chart.across else replace(chart, span=span, marks=marks)
            for chart in map(_without_blanks, charts)
            if chart.panels
        )
    )


def _span(time: FloatArray) -> tuple[float, float] | None:
    """The time axis of all charts, so that they stand one below the other: from zero where the first step begins near it."""
    if time.size < 2 or time[-1] <= time[0]:
        return None
    start, end = float(time[0]), float(time[-1])
    near_zero = 0.0 <= start < 0.02 * (end - start)
    margin = 0.01 * (end - start)
    return (0.0 if near_zero else start) - margin, end + margin


def _axis_charts(dataset: xr.Dataset, axis: Axis, scale: TimeScale, limit: int) -> Iterator[Chart]:
    """Values of every group, then errors of every group; what is unknown is left out later."""
    groups = grouped(series_of(dataset, axis), ROWS)
    time = scale.of_seconds(dataset["time"].to_numpy())
    for group in groups:
        name = group[0].group
        panels = tuple(_value_panel(one, time, limit) for one in group)
        turned = any(one.is_unwrapped for one in group)
        note = f"{_note(panels)} {ANGLE_NOTE if turned else ''}".strip()
        yield Chart(f"{axis}s_{slug(name)}", f"{axis}s", _heading(name), scale.unit, panels, note)
    for group in groups:
        name = group[0].group
        panels = tuple(_error_panel(one, time, limit) for one in group)
        title = f"{_heading(name)}: estimate minus truth"
        yield Chart(f"{axis}_errors_{slug(name)}", f"{axis}_errors", title, scale.unit, panels, _note(panels))


def _value_panel(one: Series, time: FloatArray, limit: int) -> Panel:
    value, smoothed, spreads = one.value, one.smoothed, [3 * sigma for sigma in (one.sigma, one.honest)]
    around = [edge for spread in spreads for edge in (value - spread, value + spread)]
    around += [smoothed - 3 * one.smoothed_sigma, smoothed + 3 * one.smoothed_sigma]
    columns = (value, one.truth, smoothed, one.recorded, *around)
    time, (value, truth, smoothed, recorded, *edges) = thinned(time, columns, limit)
    curves = [Curve("estimate", time, value, ROLES["value"])]
    if np.isfinite(recorded).any():
        curves.append(Curve("recorded", time, recorded, ROLES["recorded"], "dotted"))
    if np.isfinite(smoothed).any():
        curves.append(Curve("smoothed", time, smoothed, ROLES["smoothed"]))
    if np.isfinite(truth).any():
        curves.append(Curve("truth", time, truth, ROLES["truth"], "dashed"))
    return Panel(
        one.label,
        one.unit,
        tuple(curves),
        _bands(time, edges),
        view=focused((time, value), *((time, edge) for edge in edges), (time, truth), (time, recorded)),
    )


def _error_panel(one: Series, time: FloatArray, limit: int) -> Panel:
    told = one.in_error_unit
    around = [sign * 3 * sigma * told for sigma in (one.sigma, one.honest, one.smoothed_sigma) for sign in (-1, 1)]
    time, (error, smoothed, *edges) = thinned(time, (one.error * told, one.smoothed_error * told, *around), limit)
    curves = [Curve("estimate − truth", time, error, ROLES["value"])]
    if np.isfinite(smoothed).any():
        curves.append(Curve("smoothed − truth", time, smoothed, ROLES["smoothed"]))
    view = focused((time, error), *((time, edge) for edge in edges))
    return Panel(one.label, one.error_unit, tuple(curves), _bands(time, edges), view=view)


def _bands(time: FloatArray, edges: Sequence[FloatArray]) -> tuple[Band, ...]:
    """The own band, behind it the honest one, before it the smoother's; ``edges`` are lower and upper of each."""
    own = " own" if np.isfinite(edges[2]).any() else ""
    kinds = ((2, "±3σ honest", BAND_HONEST), (0, f"±3σ{own}", BAND), (4, f"±3σ{own} smoothed", BAND_SMOOTHED))
    return tuple(
        Band(name, time, edges[i], edges[i + 1], colour) for i, name, colour in kinds if np.isfinite(edges[i]).any()
    )


def _sigma_charts(dataset: xr.Dataset, scale: TimeScale, limit: int) -> Iterator[Chart]:
    """Sigmas on logarithmic axes, a panel for each group."""
    time = scale.of_seconds(dataset["time"].to_numpy())
    series = (*series_of(dataset, "output"), *series_of(dataset, "state"))
    kinds = any(name in dataset for name in ("honest_sigma", "smoothed_sigma"))  # told apart by dashes, then
    panels = [_sigma_panel(group, time, limit) for group in grouped(series, len(SERIES) if kinds else 2 * len(SERIES))]
    note = HONEST_NOTE if "honest_sigma" in dataset else ""
    if "smoothed_sigma" in dataset:
        note = f"{note} Dotted: smoothed." if note else SMOOTHED_NOTE
    for start in range(0, len(panels), ROWS):
        yield Chart("sigmas", "sigmas", "Standard deviations", scale.unit, tuple(panels[start : start + ROWS]), note)


def _sigma_panel(group: tuple[Series, ...], time: FloatArray, limit: int) -> Panel:
    curves = []
    for place, one in enumerate(group):
        turn, at = divmod(place, len(SERIES))
        colour = SERIES[at]
        sigmas = (one.sigma, one.honest, one.smoothed_sigma)
        own, honest, smoothed = (np.where(sigma > 0, sigma, np.nan) for sigma in sigmas)
        reduced, later = (bool(np.isfinite(sigma).any()) for sigma in (honest, smoothed))
        thin_time, (own, honest, smoothed) = thinned(time, (own, honest, smoothed), limit)
        plain = reduced or later or not (at + turn) % 2  # a colour that comes again is dashed where it was not
        curves.append(Curve(one.member, thin_time, own, colour, "line" if plain else "dashed"))
        if reduced:
            curves.append(Curve(f"{one.member} honest", thin_time, honest, colour, "dashed", listed=False))
        if later:
            style: Style = "dotted" if reduced else "dashed"
            curves.append(Curve(f"{one.member} smoothed", thin_time, smoothed, colour, style, listed=False))
    return Panel(_sigma_title(group), group[0].unit, tuple(curves), logarithmic=True)


def _sigma_title(group: tuple[Series, ...]) -> str:
    """The block; where it does not fit into one panel, from which of its states to which."""
    first, last = group[0], group[-1]
    whole = sum((one.group, one.unit) == (first.group, first.unit) for one in series_of(first.dataset, first.axis))
    return f"σ of {first.group}" + (f": {first.member} to {last.member}" if len(group) < whole else "")


def _note(panels: Iterable[Panel]) -> str:
    return FOCUS_NOTE if any(panel.view for panel in panels) else ""


def _heading(group: str) -> str:
    words = group.replace("_", " ")
    return words[:1].upper() + words[1:]


def _without_blanks(chart: Chart) -> Chart:
    return replace(chart, panels=tuple(panel for panel in chart.panels if not panel.is_blank()))


def _distinct(charts: Iterable[Chart]) -> Iterator[Chart]:
    """Numbers for charts that share a key and a title, from the second on."""
    used: dict[str, int] = {}
    for chart in charts:
        number = used[chart.key] = used.get(chart.key, 0) + 1
        yield chart if number == 1 else replace(chart, key=f"{chart.key}_{number}", title=f"{chart.title} ({number})")
