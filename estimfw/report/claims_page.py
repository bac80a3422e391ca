"""Claims and figures of several filters as one page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from estimfw.report.charts import charts_of
from estimfw.report.claims_tables import TONES, part_table, verdict_table
from estimfw.report.markup import note, table
from estimfw.report.panel import Chart, slug
from estimfw.report.shell import Section, chart_block, document
from estimfw.run.claim_file import ClaimFile
from estimfw.run.claims import JudgedClaim
from estimfw.run.files import output_files, write_atomically, write_text
from estimfw.version import __version__

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["claims_page", "write_claims"]

POINTS, PICTURE_POINTS = 1500, 4000
"""Of a curve of the page, and of a picture."""
SHOWN = ("states", "sigmas")
"""Sections of a result's report that a figure takes over."""

Results = Mapping[str, "xr.Dataset"]


def claims_page(stated: ClaimFile, judged: Sequence[JudgedClaim], results: Results) -> str:
    """One HTML file, which fetches nothing: verdicts, the parts of each claim, and the figures."""
    charts = figure_charts(stated, results, POINTS)
    sections = [Section("verdicts", "Verdicts", table(verdict_table(judged)))]
    sections.append(Section("claims", "The claims, part by part", "".join(map(_claim, judged))))
    for i, figure in enumerate(stated.figures):
        body = "".join(
            f"<h3>{escape(name)}</h3>\n{note(stated.filters[name].about or str(results[name].attrs.get('title', '')))}"
            + "".join(chart_block(chart, "") for chart in charts[i, name])
            for name in figure.of
        )
        sections.append(Section(f"figure-{i + 1}", figure.title, body))
    filters = "".join(f"<li><code>{escape(name)}</code>: {escape(text)}</li>\n" for name, text in _filters(stated))
    sections.append(Section("filters", "The filters", f"<ul>\n{filters}</ul>\n"))
    held = sum(one.verdict == "holds" for one in judged)
    told = f"{held} of {len(judged)} claims hold. Every figure below was computed for this page by {len(results)} runs."
    header = f"<header>\n<h1>{escape(stated.title)}</h1>\n<p>{escape(told)}</p>\n</header>\n"
    return document(stated.title, header, sections, [c for each in charts.values() for c in each], __version__)


def write_claims(
    stated: ClaimFile, judged: Sequence[JudgedClaim], results: Results, page: Path, *, force: bool = False
) -> list[Path]:
    """Write the page, and beside it a picture of each chart of its figures.

    Raises
    ------
    DataError
        A file exists, or cannot be written.
    """
    from estimfw.report.pictures import save_picture

    charts = [chart for each in figure_charts(stated, results, PICTURE_POINTS).values() for chart in each]
    pictures = {f"{page.stem}_{chart.key}.png": chart for chart in charts}
    with output_files(page.parent, (page.name, *pictures), force=force) as folder:
        written = [write_text(page, claims_page(stated, judged, results), force=force)]
        for name, chart in pictures.items():
            written.append(write_atomically(folder / name, partial(save_picture, chart), force=force))
    return written


def figure_charts(stated: ClaimFile, results: Results, points: int) -> dict[tuple[int, str], tuple[Chart, ...]]:
    """By figure and filter: states with their truth and bands, and sigmas; curves have so many points at most."""
    return {
        (i, name): tuple(_own(i, name, results[name], points))
        for i, figure in enumerate(stated.figures)
        for name in figure.of
    }


def _own(figure: int, name: str, dataset: xr.Dataset, points: int) -> Iterator[Chart]:
    states = "estimate" in dataset
    if states and "output_value" in dataset:
        dataset = dataset.drop_vars("output_value")  # outputs would show the sigmas of the same states again
    for chart in charts_of(dataset, points):
        if chart.section in (SHOWN if states else ("outputs",)):
            key = f"figure_{figure + 1}_{slug(name)}_{chart.key}"
            yield replace(chart, key=key, title=f"{name}: {chart.title[:1].lower()}{chart.title[1:]}")


def _claim(one: JudgedClaim) -> str:
    verdict = f'<span class="tone {TONES[one.verdict]}">{escape(one.verdict)}</span>'
    return f"<h3>{escape(one.claim.text)}: {verdict}</h3>\n{table(part_table(one))}"


def _filters(stated: ClaimFile) -> Iterator[tuple[str, str]]:
    """What makes each of them: its config, and what is set in it."""
    for name, one in stated.filters.items():
        told = f"{one.about + ': ' if one.about else ''}{Path(one.config).name}"
        yield name, told + "".join(f" --set '{text}'" for text in (*stated.set, *one.set))
