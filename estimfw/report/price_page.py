"""A comparison as a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

from estimfw.report.cost_tables import form_table
from estimfw.report.markup import note, table
from estimfw.report.panel import Chart
from estimfw.report.price_apart import apart_table
from estimfw.report.price_charts import price_charts
from estimfw.report.price_overlays import overlay_charts
from estimfw.report.price_tables import price_notes, price_table, value_table
from estimfw.report.price_values import Given
from estimfw.report.shell import Section, chart_block, document
from estimfw.run.compare import Comparison
from estimfw.version import __version__

__all__ = ["price_page"]

POINTS = 1500
HONEST = (
    "Honest σ is that of the physical output on the unreduced model, whatever the filter believes; where nothing approximates "
    "the model it is the filter's own."
)
LAYOUT = "All filters ran on one record with one noise."


def price_page(comparison: Comparison, values: Sequence[Given], remarks: Sequence[str] = ()) -> str:
    """One HTML file, which fetches nothing; ``remarks`` are about the published figures."""
    charts, overlaid = price_charts(comparison, POINTS), overlay_charts(comparison, POINTS)
    names = ", ".join(one.name for one in comparison.filters)
    sections = [
        Section(
            "prices",
            "What each costs",
            table(price_table(comparison)) + "".join(map(note, price_notes(comparison))) + _work(comparison),
        ),
        Section("values", "What each gives", note(HONEST) + table(value_table(values)) + "".join(map(note, remarks))),
        *_apart(comparison),
        Section("errors", "Over time", "".join(_drawn(chart) for chart in charts)),
        *_overlaid(overlaid),
        Section("made-of", "What each is made of", _made_of(comparison)),
    ]
    header = f"<header>\n<h1>Filters compared: {escape(comparison.title)}</h1>\n<p>{escape(names)}. {LAYOUT}</p>\n</header>\n"
    return document(f"Filters compared: {comparison.title}", header, sections, (*charts, *overlaid), __version__)


def _drawn(chart: Chart) -> str:
    return chart_block(chart, "")


def _work(comparison: Comparison) -> str:
    """Multiplications of each form, of the first filter that has nodes."""
    found = next((one.work for one in comparison.filters if one.work is not None), None)
    return table(form_table(found)) if found is not None else ""


def _apart(comparison: Comparison) -> Iterator[Section]:
    found = apart_table(comparison)
    if found is not None:
        yield Section("apart", "How far apart they are", table(found))


def _overlaid(charts: Sequence[Chart]) -> Iterator[Section]:
    if charts:
        yield Section("overlays", "On top of each other", "".join(_drawn(chart) for chart in charts))


def _made_of(comparison: Comparison) -> str:
    rows = []
    for one in comparison.filters:
        made = ", ".join(f"{name} ({kind})" for name, kind in one.policies) or "no policy"
        rows.append(f"<dt>{escape(one.name)}</dt><dd>{escape(one.title)}: {escape(made)}</dd>\n")
    return f'<dl class="facts">\n{"".join(rows)}</dl>\n'
