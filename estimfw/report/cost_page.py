"""What a step costs as a page, and its charts as pictures."""

from __future__ import annotations

from functools import partial
from html import escape
from pathlib import Path

from estimfw.report.cost_charts import cost_charts
from estimfw.report.cost_tables import exchange_table, form_table, measured_table, times_table, verdicts
from estimfw.report.markup import table
from estimfw.report.panel import Chart
from estimfw.report.shell import Section, chart_block, document
from estimfw.run.cost import Costed
from estimfw.run.files import refuse_existing, write_atomically, write_text
from estimfw.run.measured_cost import Measured
from estimfw.version import __version__

__all__ = ["cost_page", "write_cost"]


def _charts(costed: Costed) -> tuple[Chart, ...]:
    return cost_charts(costed.cut) if costed.cut is not None else ()


def cost_page(costed: Costed, measured: Measured | None = None) -> str:
    """One HTML file, which fetches nothing."""
    charts = _charts(costed)
    sections = [Section("forms", "Multiplications of a step", table(form_table(costed)))]
    if costed.cut is not None:
        sections += [
            Section("nodes", "Nodes", table(exchange_table(costed.cut))),
            Section(
                "speed_up",
                "A processor for each node",
                table(times_table(costed.cut)) + "".join(chart_block(chart, "") for chart in charts),
            ),
        ]
    if measured is not None:
        sections.append(Section("measured", "Measured beside predicted", table(measured_table(costed, measured))))
    title = f"Cost of a step: {costed.name}"
    lines = "".join(f"<p>{escape(text)}</p>\n" for text in verdicts(costed, measured))
    size = f"<p>{costed.states} states, {costed.rows} rows of measurements.</p>\n"
    header = f"<header>\n<h1>{escape(title)}</h1>\n{size}{lines}</header>\n"
    return document(title, header, sections, charts, __version__)


def write_cost(costed: Costed, page: Path, measured: Measured | None = None, *, force: bool = False) -> list[Path]:
    """Write the page and, beside it, a picture of each chart.

    Raises
    ------
    DataError
        A file exists, or cannot be written.
    """
    from estimfw.report.pictures import save_picture

    pictures = {page.with_name(f"{page.stem}_{chart.key}.png"): chart for chart in _charts(costed)}
    for path in (page, *pictures):
        refuse_existing(path, force=force)
    written = [write_text(page, cost_page(costed, measured), force=force)]
    for path, chart in pictures.items():
        written.append(write_atomically(path, partial(save_picture, chart), force=force))
    return written
