"""What the correction of a recorded trajectory was good for, as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from estimfw.report.numbers import UNKNOWN, plus_minus, significant
from estimfw.report.tables import Cell, Table
from estimfw.run.corrections import Correction, Misses, corrections

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["correction_table"]

KNOWN = "Errors are trajectory minus truth, over the instants whose truth is known."
UNKNOWN_TRUTH = "No truth is known, so only what was corrected can be told: recorded minus corrected, at the end."


def correction_table(dataset: xr.Dataset) -> Table:
    """Errors of each output as recorded and as corrected; the correction alone where no truth is known; else no rows."""
    every = corrections(dataset)
    if not every:
        return Table(("",), ())
    sigma = "honest σ" if any(np.isfinite(one.honest) for one in every) else "σ"
    if not any(np.isfinite(one.before.rms) for one in every):
        told = tuple((Cell(one.label), *_corrected(one), Cell(one.unit)) for one in every)
        return Table(("", "corrected by", f"{sigma} after", "unit"), told, frozenset({1, 2}), UNKNOWN_TRUTH)
    smoothed = any(one.smoothed is not None for one in every)
    more = ("rms smoothed",) if smoothed else ()
    head = ("", "rms recorded", "rms corrected", *more, "end recorded", "end corrected", f"{sigma} at the end", "unit")
    rows = tuple(_row(one, smoothed) for one in every)
    return Table(head, rows, frozenset(range(1, len(head) - 1)), KNOWN)


def _row(one: Correction, smoothed: bool) -> tuple[Cell, ...]:
    more = (Cell(_rms(one.smoothed)),) if smoothed else ()
    end, sigma = plus_minus(one.after.end, one.trusted)
    recorded = plus_minus(one.before.end, one.trusted)[0]
    return (
        Cell(one.label), Cell(_rms(one.before)), Cell(_rms(one.after)), *more, Cell(recorded), Cell(end), Cell(sigma),
        Cell(one.unit),
    )  # fmt: skip


def _rms(misses: Misses | None) -> str:
    return significant(misses.rms, 3) if misses is not None and np.isfinite(misses.rms) else UNKNOWN


def _corrected(one: Correction) -> tuple[Cell, Cell]:
    by, sigma = plus_minus(one.by, one.trusted)
    return Cell(by), Cell(sigma)
