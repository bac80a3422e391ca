"""A trial of several filters as a page and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from html import escape
from pathlib import Path

from estimfw.montecarlo.claims import Verdict
from estimfw.montecarlo.trial import Trial
from estimfw.report.markup import table
from estimfw.report.shell import Section, chart_block, document
from estimfw.report.tables import Table
from estimfw.report.trial_charts import trial_charts
from estimfw.report.trial_tables import claim_table
from estimfw.run.files import output_files, write_atomically, write_text
from estimfw.version import __version__

__all__ = ["trial_page", "write_trial"]


def trial_page(trial: Trial, verdicts: Sequence[Verdict], tables: Sequence[tuple[str, Table]]) -> str:
    """One HTML file, which fetches nothing; ``tables`` are pairs of a title and a table."""
    charts = trial_charts(trial)
    sections = [Section("claims", "Claims", table(claim_table(verdicts)))] if verdicts else []
    sections += [Section(f"table-{i}", title, table(content)) for i, (title, content) in enumerate(tables, start=1)]
    for key, title in (("rms", "Errors over time"), ("runs", "Every run")):
        blocks = "".join(chart_block(chart, title) for chart in charts if chart.section == key)
        sections.append(Section(key, title, blocks))
    header = (
        f"<header>\n<h1>Filters on the same draws: {escape(trial.title)}</h1>\n"
        f"<p>{escape(', '.join(trial.names))}. {trial.runs} runs of seed {trial.seed}.</p>\n</header>\n"
    )
    return document(f"Filters on the same draws: {trial.title}", header, sections, charts, __version__)


def write_trial(
    trial: Trial, verdicts: Sequence[Verdict], tables: Sequence[tuple[str, Table]], page: Path, *, force: bool = False
) -> list[Path]:
    """Write the page, and beside it a picture of each chart.

    Raises
    ------
    DataError
        A file exists, or cannot be written.
    """
    from estimfw.report.pictures import save_picture

    pictures = {f"{page.stem}_{chart.key}.png": chart for chart in trial_charts(trial)}
    with output_files(page.parent, (page.name, *pictures), force=force) as folder:
        written = [write_text(page, trial_page(trial, verdicts, tables), force=force)]
        for name, chart in pictures.items():
            written.append(write_atomically(folder / name, partial(save_picture, chart), force=force))
    return written
