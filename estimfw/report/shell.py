"""The frame of every page: one HTML file with its styles, its script and plotly.js inside, which fetches nothing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import Any

from plotly.offline import get_plotlyjs

from estimfw.report.heat_map import HeatMap, heat_map_figure, heat_map_height
from estimfw.report.interactive import height_of, plotly_figure
from estimfw.report.markup import data_block, note
from estimfw.report.matrix_map import MatrixMap, matrix_map_figure, matrix_map_height
from estimfw.report.palette import DARK_TWIN
from estimfw.report.panel import Chart

__all__ = ["Drawn", "Section", "chart_block", "document"]

Drawn = Chart | HeatMap | MatrixMap

POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'unsafe-inline'",
        "style-src 'unsafe-inline'",
        "img-src data: blob:",
        "form-action 'none'",
        "base-uri 'none'",
    )
)
"""The browser is told to fetch and to send nothing, whatever the page contains."""


@dataclass(frozen=True, slots=True)
class Section:
    """A part of a page; ``key`` is its anchor, ``body`` HTML."""

    key: str
    title: str
    body: str


def document(title: str, header: str, sections: Sequence[Section], charts: Sequence[Drawn], version: str) -> str:
    """The whole page; ``header`` is HTML, ``charts`` are those that the sections show (`chart_block`)."""
    figures = "".join(data_block(f"figure-{chart.key}", _figure(chart)) for chart in charts)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>\n{_asset('page.css')}</style>\n</head>\n<body>\n"
        f'<div class="frame">\n{_contents(sections)}<main>\n{header}'
        + "".join(f'<section id="{one.key}">\n<h2>{escape(one.title)}</h2>\n{one.body}</section>\n' for one in sections)
        + f"{_footer(version)}</main>\n</div>\n"
        + (f"<script>{get_plotlyjs()}</script>\n" if charts else "")
        + f"{data_block('dark-twin', DARK_TWIN)}{figures}<script>\n{_asset('page.js')}</script>\n</body>\n</html>\n"
    )


def chart_block(chart: Drawn, section: str) -> str:
    """Where a chart stands in the section of that title."""
    told = note(chart.note) if chart.note else ""
    title = "" if chart.title == section else f"<h3>{escape(chart.title)}</h3>\n"
    return (
        f"{title}{told}"
        f'<div class="chart" data-figure="figure-{chart.key}" style="height:{_height(chart)}px" role="img" '
        f'aria-label="{escape(chart.title)}"></div>\n'
    )


def _figure(chart: Drawn) -> dict[str, Any]:
    if isinstance(chart, MatrixMap):
        return matrix_map_figure(chart)
    return heat_map_figure(chart) if isinstance(chart, HeatMap) else plotly_figure(chart)


def _height(chart: Drawn) -> int:
    if isinstance(chart, MatrixMap):
        return matrix_map_height(chart)
    return heat_map_height(chart) if isinstance(chart, HeatMap) else height_of(chart)


def _contents(sections: Iterable[Section]) -> str:
    links = "".join(f'<li><a href="#{one.key}">{escape(one.title)}</a></li>\n' for one in sections)
    return f'<nav aria-label="Contents"><p>Contents</p>\n<ol>\n{links}</ol></nav>\n'


def _footer(version: str) -> str:
    return f"<footer>Made by estimfw {escape(version)} from the result alone; this page fetches nothing.</footer>\n"


def _asset(name: str) -> str:
    return files("estimfw.report").joinpath(name).read_text(encoding="utf-8")
