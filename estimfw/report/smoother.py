"""A smoother beside its filter: the table of what it gained."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from estimfw.report.numbers import significant
from estimfw.report.tables import Cell, Table
from estimfw.run.smoother_gain import Gain, gains, smoother_text

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["smoother_table"]


def smoother_table(dataset: xr.Dataset) -> Table:
    """Sigmas and errors over the whole run, of filter and smoother, in display units; no rows where no smoother ran."""
    rows = gains(dataset)
    with_error = any(np.isfinite(one.error) for one in rows)
    head = ("rms over the run", "σ", "smoothed σ", "unit", *(("error", "smoothed error") if with_error else ()))
    text = smoother_text(dataset)
    reduced = " Smoothed sigmas are those of the filter's own model." if "honest_sigma" in dataset else ""
    note = f"{text[:1].upper()}{text[1:]}. At the last epoch both are the same.{reduced}" if rows else ""
    return Table(
        head, tuple(_row(one, with_error) for one in rows), frozenset(range(1, len(head))) - {head.index("unit")}, note
    )


def _row(one: Gain, with_error: bool) -> tuple[Cell, ...]:
    sigma, smoothed, error, smoothed_error = (
        Cell(significant(value * one.display_scale, 3))
        for value in (one.sigma, one.smoothed_sigma, one.error, one.smoothed_error)
    )
    cells = (Cell(one.label), sigma, smoothed, Cell(one.display_unit))
    return (*cells, error, smoothed_error) if with_error else cells
