"""The page and the pictures of a Monte Carlo, from its result alone."""

from __future__ import annotations

from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from estimfw.report.markup import facts, note, table
from estimfw.report.montecarlo_charts import campaign_charts
from estimfw.report.montecarlo_tables import error_table, rule, verdict_table
from estimfw.report.numbers import count, instant
from estimfw.report.panel import Chart
from estimfw.report.shell import Section, chart_block, document
from estimfw.run.files import refuse_existing, write_atomically, write_text
from estimfw.run.summary import json_attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["campaign_page", "paths_beside", "write_campaign_report"]

NEES = (
    "NEES is the squared error in units of the filter's own covariance, averaged over the runs: the number of states if the "
    "filter is as good as it says, more if its sigmas are too small. The band is where the mean of so many independent runs lies."
)
NIS = "NIS is the same of the innovations: measured minus predicted, in units of what the filter expects; averaged over the runs."
ERRORS = (
    "What the runs show (rms, bias) against what the filter says of itself. They agree if the filter is consistent."
)


def paths_beside(result: Path) -> tuple[Path, Path]:
    """Of ``RESULT.nc``: the page and the folder of the pictures."""
    return result.with_suffix(".html"), result.parent / f"{result.stem}_figures"


def write_campaign_report(dataset: xr.Dataset, result: Path, *, force: bool = False) -> list[Path]:
    """Write ``RESULT.html`` and ``RESULT_figures/*.png``; the page first.

    Raises
    ------
    DataError
        A file exists, or cannot be written.
    """
    from estimfw.report.pictures import save_picture

    where, folder = paths_beside(result)
    charts = campaign_charts(dataset)
    refuse_existing(where, force=force)
    written = [write_text(where, campaign_page(dataset, charts), force=force)]
    folder.mkdir(parents=True, exist_ok=True)
    for chart in charts:
        written.append(write_atomically(folder / f"{chart.key}.png", partial(save_picture, chart), force=force))
    return written


def campaign_page(dataset: xr.Dataset, charts: tuple[Chart, ...]) -> str:
    """The result as one HTML page."""
    title = f"{dataset.attrs.get('title') or 'Filter'}: Monte Carlo"

    def drawn(key: str, heading: str, told: str) -> Section:
        return Section(key.replace("_", "-"), heading, _body(charts, key, heading, told))

    provenance = json_attribute(dataset, "provenance", {})
    sections = [
        Section("verdicts", "Is the filter as good as it says?", note(rule(dataset)) + table(verdict_table(dataset))),
        Section("errors", "Errors at the end", table(error_table(dataset))),
        drawn("nees", "NEES over time", NEES),
        drawn("nis", "NIS over time", NIS),
        drawn("output_errors", "Errors of the outputs", ERRORS),
        drawn("state_errors", "Errors of the states", ERRORS),
        Section("provenance", "Provenance", facts(_facts(provenance))),
    ]
    version = str(provenance.get("versions", {}).get("estimfw", ""))
    return document(title, _header(dataset, title), [s for s in sections if s.body], charts, version)


def _body(charts: tuple[Chart, ...], key: str, heading: str, told: str) -> str:
    blocks = "".join(chart_block(chart, heading) for chart in charts if chart.section == key)
    return note(told) + blocks if blocks else ""


def _header(dataset: xr.Dataset, title: str) -> str:
    provenance = json_attribute(dataset, "provenance", {})
    told = f"{count(dataset.sizes['run'])} runs of seed {provenance.get('seed')} to {instant(float(dataset['time'][-1]))} s"
    chips = "".join(
        f'<span class="chip {tone}">{escape(text)}</span>\n'
        for text, tone in ((_chip(entry), _tone(entry)) for entry in _shown(dataset))
    )
    return f'<header>\n<h1>{escape(title)}</h1>\n<p>{escape(told)}</p>\n<div class="chips">\n{chips}</div>\n</header>\n'


def _shown(dataset: xr.Dataset) -> list[dict[str, object]]:
    return [e for e in json_attribute(dataset, "judged", []) if e["kind"] in ("measurement", "states", "block")]


def _chip(entry: dict[str, object]) -> str:
    return f"{entry['figure']} of {entry['quantity']}: {entry['verdict']}"


def _tone(entry: dict[str, object]) -> str:
    return "good" if entry["consistent"] else "bad" if entry["checked"] else "warn"


def _facts(provenance: dict[str, object]) -> list[tuple[str, str]]:
    words = ("config_sha256", "plan_hash", "seed", "runs", "chunk", "versions")
    return [(word.replace("_", " "), _text(provenance[word])) for word in words if word in provenance]


def _text(value: object) -> str:
    return ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else str(value)
