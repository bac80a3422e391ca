"""A trial of several filters as tables and as JSON."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from estimfw.analysis.rivals import closer, settled
from estimfw.montecarlo.claims import Verdict
from estimfw.montecarlo.trial import Trial
from estimfw.report.numbers import plain, significant
from estimfw.report.tables import Cell, Table

__all__ = ["claim_table", "error_tables", "settling_table", "trial_json"]


def error_tables(trial: Trial, times: Sequence[float]) -> list[tuple[str, Table]]:
    """For every output at each instant: rms, median absolute error, in how many runs a filter is closer than the first."""
    first = trial.names[0]

    def rms(f: int, q: int, k: int) -> str:
        return significant(float(np.sqrt(np.mean(trial.error[f, :, k, q] ** 2))) * trial.scales[q], 3)

    def median(f: int, q: int, k: int) -> str:
        return significant(float(np.median(np.abs(trial.error[f, :, k, q]))) * trial.scales[q], 3)

    def better(f: int, q: int, k: int) -> str:
        return str(closer(trial.error[f, :, k, q], trial.error[0, :, k, q])) if f else ""

    return [
        ("Root mean square errors", _errors(trial, times, rms)),
        ("Median absolute errors", _errors(trial, times, median)),
        (f"Runs of {trial.runs} in which a filter is closer to the truth than {first}", _errors(trial, times, better)),
    ]


def _errors(trial: Trial, times: Sequence[float], figure: Callable[[int, int, int], str]) -> Table:
    instants = sorted(set(times)) or [float(trial.time[-1])]
    rows = [
        (
            Cell(label if not f else ""),
            Cell(name),
            *(Cell(figure(f, q, trial.at(t))) for t in instants),
            Cell(trial.units[q] if not f else ""),
        )
        for q, label in enumerate(trial.quantities)
        for f, name in enumerate(trial.names)
    ]
    head = ("output", "filter", *(f"{plain(t)} s" for t in instants), "unit")
    return Table(head, tuple(rows), frozenset(range(2, len(head) - 1)))


def settling_table(trial: Trial, output: str, bounds: Sequence[float]) -> Table:
    """Median time from which on each filter stays within each bound (display unit), and in how many runs it never does."""
    q = trial.quantity(output)
    head = ("filter", *(word for b in bounds for word in (f"within {plain(b)} {trial.units[q]} from, s", "never")))
    rows = []
    for f, name in enumerate(trial.names):
        cells = [Cell(name)]
        for bound in bounds:
            since = settled(trial.time, trial.error[f, :, :, q] * trial.scales[q], bound)
            median = float(np.median(since))
            cells += [
                Cell(plain(round(median, 1)) if np.isfinite(median) else "never"),
                Cell(str(int(np.isinf(since).sum()))),
            ]
        rows.append(tuple(cells))
    return Table(head, tuple(rows), frozenset(range(1, len(head))), f"Median over the runs, error of {output}.")


def claim_table(verdicts: Sequence[Verdict]) -> Table:
    """Each claim, its figure, its bounds, and whether it holds."""
    rows = []
    for one in verdicts:
        claim = one.claim
        bounds = " and ".join(
            word
            for word in (
                f"above {plain(claim.above)}" if claim.above is not None else "",
                f"below {plain(claim.below)}" if claim.below is not None else "",
            )
            if word
        )
        what = f"{'ratio of ' if len(claim.of) == 2 and claim.statistic != 'closer' else ''}{claim.statistic}"
        what += f", {plain(claim.at)} s" if claim.at is not None else ""
        verdict = Cell("holds", "good") if one.holds else Cell("does not hold", "bad")
        figure = f"{significant(one.figure, 3)} {one.unit}".strip() if np.isfinite(one.figure) else "never"
        rows.append((Cell(claim.text), Cell(figure), Cell(bounds), verdict, Cell(what)))
    return Table(("claim", "figure", "claimed", "verdict", "figure of"), tuple(rows), frozenset({1}))


def trial_json(trial: Trial, verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """Rms and median over time of every filter, in display units, the errors at the end, and the verdicts."""
    scaled = trial.error * trial.scales
    with np.errstate(invalid="ignore"):
        rms, median = np.sqrt(np.mean(scaled**2, axis=1)), np.median(np.abs(scaled), axis=1)
    return {
        "title": trial.title,
        "set_aside": list(trial.set_aside),
        "runs": trial.runs,
        "seed": trial.seed,
        "time": trial.time.tolist(),
        "filters": {
            name: {
                label: {
                    "unit": trial.units[q],
                    "rms": _numbers(rms[f, :, q]),
                    "median": _numbers(median[f, :, q]),
                    "end": _numbers(scaled[f, :, -1, q]),
                }
                for q, label in enumerate(trial.quantities)
            }
            for f, name in enumerate(trial.names)
        },
        "claims": [
            {
                "text": v.claim.text,
                "figure": v.figure if np.isfinite(v.figure) else None,
                "unit": v.unit,
                "holds": v.holds,
            }
            for v in verdicts
        ],
    }


def _numbers(values: np.ndarray[Any, np.dtype[np.float64]]) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in values]
