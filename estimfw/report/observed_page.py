"""What ``estimfw observe`` found, as a page."""

from __future__ import annotations

from html import escape

from estimfw.data.record import FloatArray
from estimfw.report.degree_map import NOTE
from estimfw.report.heat_map import HeatMap
from estimfw.report.markup import note, table
from estimfw.report.observed_tables import (
    DIRECTIONS_SHOWN,
    chosen_text,
    direction_note,
    headline,
    record_table,
    record_texts,
    removable_table,
    spectrum_texts,
    state_table,
)
from estimfw.report.shell import Section, chart_block, document
from estimfw.report.timescale import TimeScale
from estimfw.run.observe import Observed
from estimfw.version import __version__

__all__ = ["observed_page"]

PART_NOTE = (
    "The same of the observable part of each state: what cannot be observed is projected out, so that dark here and bright above "
    "is known but for a direction that is not observable. Blank: nothing of the state is observable."
)


def observed_page(found: Observed) -> str:
    """One HTML file, which fetches nothing."""
    maps = _maps(found)
    short = len(found.names.states) - found.frozen.rank
    rank = "".join(f"<li><code>{escape(line)}</code></li>\n" for line in spectrum_texts(found.frozen))
    drawn = "".join(chart_block(heat, "") for heat in maps)
    sections = [
        Section("directions", "Not observable", _directions(found) if short else note("Nothing.")),
        Section("states", "States", table(state_table(found))),
        Section(
            "degrees",
            "Degree with time",
            drawn or note(f"Nothing with time: {found.record_left_out}."),
        ),
        Section("removable", "What could be removed", note(chosen_text(found)) + _sets(found)),
        Section("spectrum", "How clear the rank is", f"<ul>\n{rank}</ul>\n"),
    ]
    if found.record is not None:
        told = "".join(note(line) for line in record_texts(found))
        sections.append(Section("record", "Along the record", told + table(record_table(found))))
    header = f"<header>\n<h1>Observability: {escape(found.name)}</h1>\n<p>{escape(headline(found))}</p>\n</header>\n"
    return document(f"Observability: {found.name}", header, sections, maps, __version__)


def _directions(found: Observed) -> str:
    shown = found.directions[:DIRECTIONS_SHOWN]
    lines = "".join(f"<li><strong>{escape(d.text)}</strong>{note(f'such as {d.example}')}</li>\n" for d in shown)
    told = direction_note(found)
    return f"<ul>\n{lines}</ul>\n{note(told) if told else ''}"


def _sets(found: Observed) -> str:
    content = removable_table(found)
    return table(content) if content.rows else ""


def _maps(found: Observed) -> list[HeatMap]:
    if found.record is None:
        return []
    degrees = found.record.degrees
    scale = TimeScale.of(degrees.time)

    def made(key: str, title: str, values: FloatArray, told: str) -> HeatMap:
        return HeatMap(key, title, found.names.states, scale.of_seconds(degrees.time), scale.unit, values, told)

    whole = made("posterior", "Sigma over prior sigma", degrees.posterior, NOTE)
    if found.time_invariant and found.frozen.rank == len(found.names.states):
        return [whole]
    return [whole, made("observable_part", "The same of the observable part", degrees.observable_part, PART_NOTE)]
