"""One HTML page that opens anywhere, without a network, and shows a whole result."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from io import StringIO
from typing import TYPE_CHECKING, Any

from estimfw.report.bank import bank_line, bank_table
from estimfw.report.charts import charts_of
from estimfw.report.correction_table import correction_table
from estimfw.report.degree_map import degree_map
from estimfw.report.headline import Headline, headlines, start_line
from estimfw.report.heat_map import HeatMap
from estimfw.report.judgement import nis_verdict, sigma_caveat
from estimfw.report.markup import facts, note, table
from estimfw.report.nodes import node_table
from estimfw.report.numbers import UNKNOWN, count, instant
from estimfw.report.panel import Chart
from estimfw.report.shell import Section, chart_block, document
from estimfw.report.smoother import smoother_table
from estimfw.report.stages import stage_table
from estimfw.report.tables import (
    disposition_table,
    end_table,
    equivalence_table,
    event_table,
    meaning_table,
    policy_table,
)
from estimfw.run.plausibility import cautions
from estimfw.run.result_names import measurement_names
from estimfw.run.summary import events_of, json_attribute, measurement_summaries

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["page"]

EVENTS_SHOWN = 1000
DATA_BYTES = 3_800_000
"""For the curves of a page; plotly.js itself takes 4.8 MB of the 10."""

INNOVATIONS = "What was measured minus what the filter predicted, and the ±3σ in which it expects that to lie."
NIS = (
    "NIS is the squared innovation in units of the covariance that the filter predicts for it; on average it should be the "
    "number of measured components. It judges innovations alone: what the measurements do not see can still be wrong."
)
LOOPS = {
    "open": "Open loop: the nominal (the mechanization) runs on undisturbed. Error states are what it is wrong by, however "
    "much that grows; the outputs are corrected by them.",
    "closed": "Closed loop: estimated errors are fed back into the nominal (the mechanization) at every step, so error "
    "states that it can take stay near zero. Their bands are the uncertainty of the corrected nominal.",
}


def page(dataset: xr.Dataset) -> str:
    """The report of a result as HTML, with its styles, its script and plotly.js inside.

    Long records are thinned so that the page stays below 10 MB; extremes are kept (`kept_rows`).
    """
    charts = charts_of(dataset, points_per_curve(dataset))
    sections = [section for section in _sections(dataset, charts) if section.body]
    title = str(dataset.attrs.get("title") or "Estimation result")
    heat = degree_map(dataset)
    shown: list[Chart | HeatMap] = [*charts, *([heat] if heat is not None else [])]
    return document(title, _header(dataset, title), sections, shown, _version(dataset))


def points_per_curve(dataset: xr.Dataset) -> int:
    """How many points a curve may have, so that all of them fit into the page."""
    series = dataset.sizes.get("state", 0) + dataset.sizes.get("output", 0)
    rows = sum(dataset.sizes.get(f"{name}_row", 1) for name in measurement_names(dataset))
    curves = (13 if "smoothed" in dataset else 9) * series + 4 * rows + 12 * len(measurement_names(dataset))
    bytes_of_a_point = 2 * 4 * 4 / 3
    return max(40, min(4000, int(DATA_BYTES / bytes_of_a_point / max(curves, 1))))


def _sections(dataset: xr.Dataset, charts: Sequence[Chart]) -> Iterator[Section]:
    by_section: dict[str, list[Chart]] = {}
    for chart in charts:
        by_section.setdefault(chart.section, []).append(chart)

    def drawn(key: str, title: str, told: str = "") -> Section:
        body = "".join(chart_block(chart, title) for chart in by_section.get(key, ()))
        return Section(key.replace("_", "-"), title, (note(told) if told and body else "") + body)

    yield Section(
        "headline",
        "At the end",
        _headline_cards(headlines(dataset), start_line(dataset), bank_line(dataset)) + table(end_table(dataset)),
    )
    gained = smoother_table(dataset)
    yield Section("smoother", "Smoother", table(gained) if gained.rows else "")
    corrected = correction_table(dataset)
    yield Section("corrections", "Before and after the correction", table(corrected) if corrected.rows else "")
    meanings = meaning_table(dataset)
    yield Section("meanings", "What states stand for", table(meanings) if meanings.rows else "")
    members = bank_table(dataset)
    bank = drawn("bank", "Bank")
    yield Section("bank", bank.title, bank.body + table(members) if members.rows else "")
    stages = stage_table(dataset)
    yield Section("stages", "Stages", table(stages) if stages.rows else "")
    nodes = node_table(dataset)
    yield Section("nodes", "Nodes and what they sent", table(nodes) if nodes.rows else "")
    yield drawn("outputs", "Convergence of the outputs")
    yield drawn("output_errors", "Errors of the outputs")
    yield drawn("states", "States", _loop_note(dataset))
    yield drawn("state_errors", "Errors of the states")
    yield drawn("sigmas", "Standard deviations")
    heat, told = degree_map(dataset), "How much the measurements tell of each state"
    yield Section("degrees", told, chart_block(heat, heat.title) if heat is not None else "")
    yield drawn("innovations", "Innovations", INNOVATIONS)
    yield drawn("nis", "Consistency (NIS)", NIS)
    yield Section("dispositions", "What became of the measurements", table(disposition_table(dataset)))
    yield Section("events", "Events", table(event_table(dataset, EVENTS_SHOWN)))
    yield Section("policies", "Policies", table(policy_table(dataset)))
    yield Section("equivalence", "Equivalence of model and mechanization", table(equivalence_table(dataset)))
    yield Section("provenance", "Provenance", _provenance(dataset))


def _loop_note(dataset: xr.Dataset) -> str:
    """Why error states grow or stay at zero, where there is a nominal that they are the errors of."""
    if not json_attribute(dataset, "equivalence", []):
        return ""
    return LOOPS.get(str(json_attribute(dataset, "provenance", {}).get("loop")), "")


def _header(dataset: xr.Dataset, title: str) -> str:
    provenance = json_attribute(dataset, "provenance", {})
    time = dataset["time"].to_numpy()
    told = [f"{count(time.size)} steps to {instant(float(time[-1]))} s"] if time.size else ["no steps"]
    told += [
        f"{word} {provenance[word]}"
        for word in ("estimator", "covariance", "kernel", "seed")
        if provenance.get(word) is not None
    ]
    chips = "".join(f'<span class="chip {tone}">{escape(text)}</span>\n' for text, tone in _chips(dataset))
    return (
        f"<header>\n<h1>{escape(title)}</h1>\n<p>{escape(' · '.join(told))}</p>\n"
        f'<div class="chips">\n{chips}</div>\n{_mismatches(dataset)}{_cautions(dataset)}{_caveat(dataset)}</header>\n'
    )


def _chips(dataset: xr.Dataset) -> Iterator[tuple[str, str]]:
    for one in measurement_summaries(dataset):
        yield f"{one.name}: {count(one.counts['fused'])} of {count(one.total)} fused", ""
        verdict = nis_verdict(one)
        if verdict.tone:
            yield f"NIS of {one.name} {verdict.text}", verdict.tone
    events = sum(event.count for event in events_of(dataset))
    yield (f"{count(events)} event{'s' if events != 1 else ''}", "warn" if events else "good")


def _mismatches(dataset: xr.Dataset) -> str:
    entries = [entry for entry in json_attribute(dataset, "equivalence", []) if entry.get("status") == "mismatch"]
    if not entries:
        return ""
    lines = "".join(
        f"<li><code>{escape(str(e.get('operation')))}</code>: {escape(str(e.get('text')))}</li>" for e in entries
    )
    return f'<div class="banner"><strong>Model and mechanization do not match.</strong><ul>{lines}</ul></div>\n'


def _cautions(dataset: xr.Dataset) -> str:
    told = cautions(dataset)
    if not told:
        return ""
    lines = "".join(f"<li>{escape(one)}</li>" for one in told)
    return f'<div class="banner"><strong>Caution: the data contradict the filter.</strong><ul>{lines}</ul></div>\n'


def _caveat(dataset: xr.Dataset) -> str:
    text = sigma_caveat(dataset)
    return f'<div class="banner caveat">{escape(text)}</div>\n' if text else ""


def _headline_cards(lines: Iterable[Headline], *told: str) -> str:
    cards = "".join(_card(line) for line in lines)
    return (
        f'<div class="cards">\n{cards}</div>\n{"".join(note(one) for one in told if one)}<h3>All values</h3>\n'
        if cards
        else ""
    )


def _card(line: Headline) -> str:
    fine = f" (±{escape(line.fine)})" if line.fine else ""
    verdict = "" if line.trusted else " bad"
    error = f'<div class="small{verdict}">error {escape(line.error)}</div>' if line.error else ""
    sigma = f'<div class="sigma">±{escape(line.sigma + line.unit)}{fine}</div>' if line.sigma != UNKNOWN else ""
    return (
        f'<div class="card"><div class="name">{escape(line.name)}</div>'
        f'<div class="value">{escape(line.value + line.unit)}</div>'
        f"{sigma}{error}</div>\n"
    )


def _provenance(dataset: xr.Dataset) -> str:
    provenance = json_attribute(dataset, "provenance", {})
    pairs = [pair for key, value in provenance.items() if key != "config" for pair in _flat(str(key), value)]
    config = provenance.get("config")
    shown = (
        ""
        if not config
        else f"<details><summary>Resolved config</summary>\n<pre>{escape(_yaml(config))}</pre></details>\n"
    )
    return facts(pairs) + shown if pairs or shown else ""


def _flat(name: str, value: Any) -> Iterator[tuple[str, str]]:
    name = name.replace("_", " ")
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _flat(f"{name}: {key}", item)
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        for number, item in enumerate(value):
            yield from _flat(f"{name} {number + 1}", item)
    elif isinstance(value, list):
        yield name, ", ".join(str(item) for item in value)
    elif value is not None:
        shown = ("yes" if value else "no") if isinstance(value, bool) else str(value)
        yield name, f"{value:.6g}" if isinstance(value, float) else shown


def _yaml(config: Any) -> str:
    from ruamel.yaml import YAML

    writer = YAML()
    writer.width = 100
    out = StringIO()
    writer.dump(config, out)
    return out.getvalue()


def _version(dataset: xr.Dataset) -> str:
    versions = json_attribute(dataset, "provenance", {}).get("versions")
    return str(versions.get("estimfw", "")) if isinstance(versions, dict) else ""
