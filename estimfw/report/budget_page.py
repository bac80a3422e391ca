"""An error budget as a page and a picture."""

from __future__ import annotations

from functools import partial
from html import escape
from pathlib import Path

from estimfw.report.budget_charts import budget_charts
from estimfw.report.budget_tables import largest_texts, source_table
from estimfw.report.markup import table
from estimfw.report.numbers import instant
from estimfw.report.panel import Chart
from estimfw.report.shell import Section, chart_block, document
from estimfw.run.budget import Budget
from estimfw.run.files import refuse_existing, write_atomically, write_text
from estimfw.version import __version__

__all__ = ["budget_page", "write_budget"]


def budget_page(budget: Budget) -> str:
    """One HTML file, which fetches nothing."""
    charts = budget_charts(budget)
    end = f"{instant(float(budget.time[-1]))} s"
    lines = "".join(f"<li>{escape(text)}</li>\n" for text in largest_texts(budget))
    sections = [
        Section("largest", f"Largest sources at {end}", f"<ul>\n{lines}</ul>\n"),
        Section("shares", "What the errors come from", _drawn(charts, "shares", "What the errors come from")),
        Section("sigmas", "Sigmas", _drawn(charts, "sigmas", "Sigmas")),
        Section("sources", f"All sources at {end}", table(source_table(budget))),
    ]
    title = f"Error budget: {budget.name}"
    told = f"Errors of this filter on the model of: {budget.truth_name}."
    told += f" Zero in that model: {', '.join(budget.absent)}." if budget.absent else ""
    header = f"<header>\n<h1>{escape(title)}</h1>\n<p>{escape(told)}</p>\n</header>\n"
    return document(title, header, sections, charts, __version__)


def _drawn(charts: tuple[Chart, ...], key: str, heading: str) -> str:
    return "".join(chart_block(chart, heading) for chart in charts if chart.section == key)


def write_budget(budget: Budget, page: Path, *, force: bool = False) -> list[Path]:
    """Write the page and, beside it, the stacked picture ``PAGE.png``.

    Raises
    ------
    DataError
        A file exists, or cannot be written.
    """
    from estimfw.report.pictures import save_picture

    stacked = [chart for chart in budget_charts(budget) if chart.section == "shares"]
    pictures = [page.with_name(f"{page.stem}{chart.key.removeprefix('shares')}.png") for chart in stacked]
    for path in (page, *pictures):
        refuse_existing(path, force=force)
    written = [write_text(page, budget_page(budget), force=force)]
    for chart, path in zip(stacked, pictures, strict=True):
        written.append(write_atomically(path, partial(save_picture, chart), force=force))
    return written
