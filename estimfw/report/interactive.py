"""Charts as plotly figures: plain dicts, so that no plotly is needed to make them."""

from __future__ import annotations

import base64
from html import escape
from typing import Any

import numpy as np

from estimfw.data.record import FloatArray
from estimfw.report.panel import Band, Chart, Curve, Panel

__all__ = ["height_of", "plotly_figure"]

ROW, HEAD, FOOT, GAP = 190, 54, 52, 62
"""Pixels: of a panel, above the first one, of the time axis below all, and between panels (title and legend)."""

LEFT = 82
"""Pixels at the left: the same for every chart, whatever its tick labels, so that their time axes start at one place."""

RESOLVED = 1e-3
"""A range this small against its distance from zero needs more than the seven digits of a float32."""

LINEAR = 0.7
"""Decades below which a logarithmic axis looks like a linear one."""

MARK = "#868e96"
"""Grey that is read on a light page and on a dark one."""

DASHES = {"line": "solid", "dashed": "dash", "dotted": "dot"}


def plotly_figure(chart: Chart) -> dict[str, Any]:
    """The chart as ``{"data": [...], "layout": {...}}``, its arrays packed as plotly.js reads them.

    Colours are those of the light page; the page itself exchanges them on a dark one.
    """
    row, inner = _heights(chart)
    figure: dict[str, Any] = {"data": [], "layout": _frame(chart)}
    for begin, name in chart.marks:
        figure["layout"]["shapes"].append(_mark(begin))
        figure["layout"]["annotations"].append(_mark_name(begin, name))
    named: tuple[str, ...] = ()
    for place, panel in enumerate(chart.panels):
        number = str(place + 1) if place else ""
        top = 1 - place * (row + GAP) / inner
        names = tuple(curve.name for curve in panel.curves)
        figure["layout"][f"yaxis{number}"] = _vertical_axis(panel, max(0.0, top - row / inner), top)
        figure["layout"][f"yaxis{number}"] |= {"scaleanchor": "x"} if chart.across else {}
        figure["layout"][f"legend{number}"] = _legend(top)
        figure["layout"]["annotations"].append(_title(panel, top))
        figure["data"] += _panel_traces(panel, number, in_legend=names != named)
        named = named or names
    return figure


def height_of(chart: Chart) -> int:
    """Pixels that the figure takes on the page."""
    return HEAD + _heights(chart)[1] + FOOT


def _heights(chart: Chart) -> tuple[int, int]:
    """Pixels of a panel, and of all with what is between them."""
    rows = len(chart.panels)
    row = ROW * 2 if rows == 1 else ROW
    return row, row * rows + GAP * (rows - 1)


def _frame(chart: Chart) -> dict[str, Any]:
    rows = len(chart.panels)
    return {
        "height": height_of(chart),
        "margin": {"l": LEFT, "r": 14, "t": HEAD, "b": FOOT},
        "hovermode": "closest" if chart.across else "x",
        "showlegend": True,
        "annotations": [],
        "shapes": [],
        "xaxis": {
            "title": {"text": chart.horizontal},
            "anchor": f"y{rows}" if rows > 1 else "y",
            **({"range": list(chart.span)} if chart.span else {}),
            **({"type": "log", "dtick": 1, "exponentformat": "power"} if chart.over else {}),
            **({"type": "log", "dtick": 1} if chart.over else {}),
        },
    }


def _vertical_axis(panel: Panel, bottom: float, top: float) -> dict[str, Any]:
    axis: dict[str, Any] = {"domain": [bottom, min(1.0, top)], "title": {"text": escape(panel.unit)}}
    if panel.logarithmic:
        axis |= {"type": "log", "tickformat": "~g", **_log_ticks(panel)}
    if panel.view:
        low, high = (float(np.log10(end)) if panel.logarithmic else end for end in panel.view)
        axis["range"] = [low, high]
    return axis


def _log_ticks(panel: Panel) -> dict[str, Any]:
    """Few round ticks within a decade, at 1, 2, 5 over few decades, at powers of ten over many."""
    if panel.decades < LINEAR:
        return {"nticks": 5}
    return {"dtick": "D2" if panel.decades < 2 else max(1, round(panel.decades / 5))}


def _title(panel: Panel, top: float) -> dict[str, Any]:
    return {
        "text": escape(panel.title),
        "x": 0,
        "xref": "paper",
        "xanchor": "left",
        "y": top,
        "yref": "paper",
        "yanchor": "bottom",
        "showarrow": False,
    }


def _mark(begin: float) -> dict[str, Any]:
    """A line through all panels."""
    line = {"color": MARK, "width": 1, "dash": "dot"}
    return {"type": "line", "x0": begin, "x1": begin, "xref": "x", "y0": 0, "y1": 1, "yref": "paper", "line": line}


def _mark_name(begin: float, name: str) -> dict[str, Any]:
    """At the right of the line, inside of the first panel."""
    place = {"x": begin, "xref": "x", "xanchor": "left", "y": 1, "yref": "paper", "yanchor": "top"}
    return {"text": escape(name), "showarrow": False, "font": {"size": 11, "color": MARK}, **place}


def _legend(top: float) -> dict[str, Any]:
    """A row at the right, above its panel."""
    place = {"x": 1, "xanchor": "right", "xref": "paper", "y": top, "yanchor": "bottom", "yref": "paper"}
    return {"orientation": "h", **place}


def _panel_traces(panel: Panel, number: str, *, in_legend: bool) -> list[dict[str, Any]]:
    traces = [trace for band in panel.bands for trace in _band_traces(band)]
    traces += [_curve_trace(curve) for curve in panel.curves]
    where = {"yaxis": f"y{number}", "legend": f"legend{number}"}
    return [{**trace, **where, "showlegend": in_legend and trace.get("showlegend", True)} for trace in traces]


def _band_traces(band: Band) -> list[dict[str, Any]]:
    line = {"color": band.colour[:7], "width": 0.8}
    edge = {
        "type": "scatter",
        "mode": "lines",
        "x": packed(band.time),
        "name": escape(band.name),
        "legendgroup": band.name,
        "line": line,
        "opacity": 0.6,
        "hoverinfo": "skip",
    }
    lower = {**edge, "y": packed(band.lower), "showlegend": False}
    upper = {**edge, "y": packed(band.upper), "fill": "tonexty", "fillcolor": band.colour}
    return [lower, upper]


def _curve_trace(curve: Curve) -> dict[str, Any]:
    trace: dict[str, Any] = {
        "type": "scatter",
        "x": packed(curve.time),
        "y": packed(curve.values),
        "name": escape(curve.name),
        "legendgroup": curve.name,
    }
    if not curve.listed:
        trace["showlegend"] = False
    if curve.style in DASHES:
        alone = np.isfinite(curve.values).sum() == 1
        trace |= {"mode": "markers" if alone else "lines", "marker": {"color": curve.colour, "size": 8}}
        return trace | {"line": {"color": curve.colour, "width": 1.6, "dash": DASHES[curve.style]}}
    crosses = curve.style == "crosses"
    marker = {"color": curve.colour, "size": 8 if crosses else 4, "symbol": "x-thin-open" if crosses else "circle"}
    return trace | {"mode": "markers", "marker": marker | ({"line": {"width": 2}} if crosses else {})}


def packed(values: FloatArray) -> dict[str, str]:
    """The array in plotly.js' typed form: base64 of little-endian floats, of 4 bytes where these resolve its range."""
    known = values[np.isfinite(values)]
    resolved = known.size == 0 or np.ptp(known) >= RESOLVED * np.abs(known).max()
    kind = "f4" if resolved and np.abs(known).max(initial=0) < np.finfo(np.float32).max else "f8"
    gaps = np.where(np.isfinite(values), values, np.nan)
    return {"dtype": kind, "bdata": base64.b64encode(gaps.astype(f"<{kind}").tobytes()).decode()}
