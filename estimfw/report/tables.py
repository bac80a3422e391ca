"""The tables of a result as rows of cells, for the page and for the terminal alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from estimfw.data.record import Event
from estimfw.report.judgement import nis_verdict
from estimfw.report.numbers import UNKNOWN, count, instant, measured, plain, plus_minus, significant
from estimfw.run.result_names import DISPOSITIONS
from estimfw.run.summary import (
    EndValue,
    MeasurementSummary,
    end_outputs,
    end_states,
    events_of,
    json_attribute,
    measurement_summaries,
)

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "Cell",
    "Table",
    "disposition_table",
    "end_table",
    "equivalence_table",
    "event_table",
    "meaning_table",
    "policy_table",
]


REMOVED = ("states", "terms", "rows", "noises")


@dataclass(frozen=True, slots=True)
class Cell:
    """A text, maybe of several lines; ``tone`` is ``good``, ``bad``, ``warn`` or empty."""

    text: str
    tone: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """Head and rows; columns in ``numeric`` are set flush right. ``note`` says what was left out."""

    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    numeric: frozenset[int] = frozenset()
    note: str = ""


def end_table(dataset: xr.Dataset) -> Table:
    """Outputs and states at the end, in display units; errors where truth is known."""
    ends = (*end_outputs(dataset), *end_states(dataset))
    with_error = any(np.isfinite(end.error) for end in ends)
    with_honest = any(np.isfinite(end.honest) for end in ends)
    sigmas: tuple[str, ...] = ("own σ", "honest σ") if with_honest else ("σ",)
    if not any(np.isfinite(end.sigma) for end in ends):
        sigmas = ()  # a determination
    ratio = (f"error / {sigmas[-1]}",) if sigmas else ()
    head = ("", "value", *sigmas, "unit", *(("error", *ratio) if with_error else ()))
    rows = tuple(_end_row(end, len(sigmas), with_error) for end in ends)
    last = float(dataset["time"].to_numpy()[-1]) if dataset.sizes["time"] else np.nan
    early = sorted({end.time for end in ends if end.time < last and np.isfinite(end.value)})
    note = f"Last known values; some end before the run does (at {instant(early[0])} s)." if early else ""
    return Table(head, rows, frozenset(range(1, len(head))) - {head.index("unit")}, note)


def _end_row(end: EndValue, sigma_columns: int, with_error: bool) -> tuple[Cell, ...]:
    value, sigma, error = end.display()
    trusted = end.trusted * end.display_scale
    own, honest = Cell(plus_minus(value, sigma)[1]), Cell(plus_minus(value, trusted)[1])
    sigmas = (own, honest)[:sigma_columns]
    cells = (Cell(end.label), Cell(plus_minus(value, trusted)[0]), *sigmas, Cell(end.display_unit))
    if not with_error:
        return cells
    if not sigmas:
        return (*cells, Cell(significant(error, 4)))
    ratio = error / trusted if trusted > 0 else np.nan
    tone = "bad" if abs(ratio) > 3 else ""
    return (*cells, Cell(plus_minus(error, trusted)[0]), Cell(significant(ratio, 2), tone))


def meaning_table(dataset: xr.Dataset) -> Table:
    """States that stand for combinations; no rows where each is what its name says. Outputs that they correct are in the note."""
    rows = tuple((Cell(end.label), Cell(end.meaning)) for end in end_states(dataset) if end.meaning)
    outputs = ", ".join(end.label for end in end_outputs(dataset) if end.meaning)
    told = f" So {outputs} are corrected by such combinations." if outputs else ""
    note = f"An exact quotient: nothing of the whole filter is lost, but these are not told apart.{told} Factors in SI units."
    return Table(("state", "stands for"), rows, note=note if rows else "")


def disposition_table(dataset: xr.Dataset, *, brief: bool = False) -> Table:
    """What became of each measurement, and whether its NIS is what chi-square says; ``brief`` leaves out what never was."""
    measurements = measurement_summaries(dataset)
    words = [w for w in DISPOSITIONS if w == "fused" or not brief or any(one.counts[w] for one in measurements)]
    head = ("measurement", "epochs", *words, "mean NIS", "expected", "verdict")
    return Table(head, tuple(_disposition_row(one, words) for one in measurements), frozenset(range(1, len(words) + 4)))


def _disposition_row(one: MeasurementSummary, words: list[str]) -> tuple[Cell, ...]:
    counts = [Cell(count(one.counts[w]), "warn" if one.counts[w] and w != "fused" else "") for w in words]
    means = (Cell(significant(one.nis_mean, 3)), Cell(plain(one.freedom)))
    verdict = nis_verdict(one)
    return (Cell(one.name), Cell(count(one.total)), *counts, *means, Cell(verdict.text, verdict.tone))


def event_table(dataset: xr.Dataset, most: int) -> Table:
    """The first ``most`` events."""
    events = events_of(dataset)
    rows = tuple(_event_row(event) for event in events[:most])
    left = len(events) - most
    note = f"{count(left)} more events are in the result." if left > 0 else ""
    return Table(("time, s", "source", "kind", "count", "what happened"), rows, frozenset({0, 3}), note)


def _event_row(event: Event) -> tuple[Cell, ...]:
    return (Cell(instant(event.time)), Cell(event.source), Cell(event.kind), Cell(count(event.count)), Cell(event.text))


def policy_table(dataset: xr.Dataset) -> Table:
    """What each policy did to the model, on what condition, and how well that holds."""
    policies = json_attribute(dataset, "policies", [])
    rows = tuple(_policy_row(number + 1, policy) for number, policy in enumerate(policies))
    return Table(("", "policy", "kind", "states", "removed", "when it holds, and how well"), rows, frozenset({0}))


def _policy_row(number: int, policy: dict[str, Any]) -> tuple[Cell, ...]:
    kind = str(policy.get("kind", ""))
    tone = {"exact": "good", "mirrored": "good", "approximate": "warn"}.get(kind, "")
    removed = [label for part in REMOVED for label in policy.get(f"removed_{part}") or []]
    condition = str(policy.get("condition") or policy.get("text") or "")
    return (
        Cell(str(number)),
        Cell(str(policy.get("label", ""))),
        Cell(kind, tone),
        Cell(f"{len(policy.get('before') or [])} → {len(policy.get('after') or [])}"),
        Cell("\n".join(map(str, removed)) or UNKNOWN),
        Cell("\n".join(filter(None, (condition, *_measures(policy)))) or UNKNOWN),
    )


def _measures(policy: dict[str, Any]) -> list[str]:
    """The numbers that the policy gives for how well its condition holds."""
    number = policy.get("number")
    measures = policy.get("measures") or ([{**number, "name": ""}] if number else [])
    return [measured(str(one.get("name", "")), float(one["value"]), str(one.get("unit", ""))) for one in measures]


def equivalence_table(dataset: xr.Dataset) -> Table:
    """For each operation of the nominal provider: is it computed, and has the error model its mirror?"""
    entries = json_attribute(dataset, "equivalence", [])
    explained = any(entry.get("status") == "mismatch" for entry in entries)
    head = ("operation", "mirrored by", "in the model", "computed", "setting", "status", *(("",) if explained else ()))
    return Table(head, tuple(_equivalence_row(entry, explained) for entry in entries))


def _equivalence_row(entry: dict[str, Any], explained: bool) -> tuple[Cell, ...]:
    status = str(entry.get("status", ""))
    cells = (
        Cell(str(entry.get("operation", ""))),
        Cell(str(entry.get("mirror") or UNKNOWN)),
        Cell("yes" if entry.get("in_model") else "no"),
        Cell("yes" if entry.get("computed") else "no"),
        Cell(str(entry.get("setting", ""))),
        Cell(status, {"equivalent": "good", "mismatch": "bad"}.get(status, "")),
    )
    return (*cells, Cell(str(entry.get("text") or ""))) if explained else cells
