"""The tables of a Monte Carlo: errors at the end against sigmas, and what is consistent."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from estimfw.report.numbers import UNKNOWN, plain, significant
from estimfw.report.tables import Cell, Table
from estimfw.run.summary import json_attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["error_table", "rule", "verdict_table"]

#: Share of gated epochs from which on it is told.
MUCH = 0.02


def error_table(dataset: xr.Dataset) -> Table:
    """Bias, rms, spread and sigmas of every output and state at the last instant, in display units."""
    honest = "honest_sigma" in dataset
    head = ("", "unit", "bias", "spread", "rms", "own σ", "rms / σ", *(("honest σ", "rms / honest") if honest else ()))
    axes = [(axis, prefix) for axis, prefix in (("output", "output_"), ("state", "")) if axis in dataset.sizes]
    rows = [row for axis, prefix in axes for row in _error_rows(dataset, axis, prefix, honest)]
    return Table(head, tuple(rows), frozenset(range(2, len(head))))


def _error_rows(dataset: xr.Dataset, axis: str, prefix: str, honest: bool) -> Iterator[tuple[Cell, ...]]:
    for i, label in enumerate(dataset[axis].to_numpy()):
        scale, unit = float(dataset[f"{axis}_display_scale"][i]), str(dataset[f"{axis}_display_unit"].to_numpy()[i])

        def at_end(name: str, factor: float = scale, place: int = i) -> Cell:
            value = float(dataset[f"{prefix}{name}"].to_numpy()[-1, place])
            return Cell(significant(value * factor, 3))

        cells = [Cell(str(label)), Cell(unit), *(at_end(name) for name in ("bias", "spread", "rms", "sigma"))]
        cells.append(at_end("ratio", 1.0))
        if honest:
            cells += [at_end("honest_sigma"), at_end("honest_ratio", 1.0)]
        yield tuple(cells)


def verdict_table(dataset: xr.Dataset, *, brief: bool = False) -> Table:
    """What was judged: mean over time and runs and its bounds, the same at the last instant, and the verdict.

    ``brief`` leaves out single states and outputs that are consistent.
    """
    head = ("", "figure", "verdict", "expected", "over time", "bounds", "at the end", "its bounds", "outside")
    entries = json_attribute(dataset, "judged", [])
    shown = [e for e in entries if not (brief and e["consistent"] and e["kind"] in ("state", "output"))]
    hidden = len(entries) - len(shown)
    return Table(
        head,
        tuple(_verdict_row(entry) for entry in shown),
        frozenset(range(3, 9)),
        " ".join([*([f"and {hidden} single states and outputs, all consistent."] if hidden else []), *_gates(dataset)]),
    )


def _gates(dataset: xr.Dataset) -> Iterator[str]:
    """Where gates refused so much that an honest sigma cannot hold: they decide by the errors that it is to tell."""
    if "honest_nees" not in dataset:
        return
    shares = dataset["gated"].mean("run").to_numpy()
    for name, share in zip(dataset["measurement"].to_numpy(), shares, strict=True):
        if share > MUCH:
            yield (
                f"{name} was gated in {100 * share:.0f} % of its epochs: honest sigmas are those of the rows that the first run "
                "fused, and know nothing of errors for which a gate refuses what would tell them."
            )


def _verdict_row(entry: dict[str, Any]) -> tuple[Cell, ...]:
    whole, end = entry["over_time"], entry["at_end"]
    good = "good" if entry["consistent"] else "bad" if entry["checked"] else "warn"
    outside = entry["instants_outside"]
    return (
        Cell(entry["quantity"]),
        Cell(entry["figure"]),
        Cell(entry["verdict"] + ("" if entry["checked"] else " (own)"), good),
        Cell(plain(entry["degrees_of_freedom"])),
        Cell(significant(whole["mean"], 4)),
        Cell(f"{significant(whole['low'], 3)} to {significant(whole['high'], 3)}"),
        Cell(significant(end["mean"], 4) if end else UNKNOWN),
        Cell(f"{significant(end['low'], 3)} to {significant(end['high'], 3)}" if end else UNKNOWN),
        Cell(f"{100 * outside:.0f} %" if outside == outside else UNKNOWN),
    )


def rule(dataset: xr.Dataset) -> str:
    """How it is judged, in a sentence or two."""
    share = plain(100 * float(dataset.attrs["confidence"]))
    return (
        f"A consistent filter passes all of these together with {share} % confidence: each mean over time and runs is judged "
        "with the effective number of independent samples that the scatter between runs shows, the last instant with the "
        f"number of runs. The share of instants outside their own {share} % bounds is told, not judged: they are correlated."
    )
