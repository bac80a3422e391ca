"""What is drawn, apart from how: panels of bands and curves, gathered into charts.

Everything is in display units, unwrapped, and small: the two ways of drawing (pictures, page) do no arithmetic.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from estimfw.data.record import FloatArray
from estimfw.report.decimate import kept_rows

__all__ = ["Band", "Chart", "Curve", "Panel", "Style", "focused", "slug", "thinned"]

Style = Literal["line", "dashed", "dotted", "dots", "crosses"]

OFF_SCALE = 3.5
SETTLED = 0.2


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve: ``time`` and ``values`` are (N,), NaN is a gap; ``colour`` is one of the palette's.

    ``listed`` False: the legend leaves it out.
    """

    name: str
    time: FloatArray
    values: FloatArray
    colour: str
    style: Style = "line"
    listed: bool = True


@dataclass(frozen=True, slots=True)
class Band:
    """The area between ``lower`` and ``upper``, (N,) each."""

    name: str
    time: FloatArray
    lower: FloatArray
    upper: FloatArray
    colour: str


@dataclass(frozen=True, slots=True)
class Panel:
    """One pair of axes. ``view`` limits the vertical axis where the full range would hide the interesting part."""

    title: str
    unit: str
    curves: tuple[Curve, ...]
    bands: tuple[Band, ...] = ()
    logarithmic: bool = False
    view: tuple[float, float] | None = None

    @property
    def decades(self) -> float:
        """How many powers of ten a logarithmic panel shows."""
        edges = [edge for band in self.bands for edge in (band.lower, band.upper)]
        values = np.concatenate([*(curve.values for curve in self.curves), *edges])
        low, high = self.view or (np.nanmin(values), np.nanmax(values))
        return float(np.log10(high / low)) if low > 0 else 0.0

    def is_blank(self) -> bool:
        """No curve has a finite value, nor has a band where there are no curves."""
        values = [c.values for c in self.curves] or [band.upper for band in self.bands]
        return not any(np.isfinite(one).any() for one in values)


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels over one time axis, which goes over ``span`` (start, end) where that is known.

    ``key`` is unique in a report and fit for a file name, ``section`` the part of the report it belongs to, ``note`` a
    sentence below the title. A map has in ``across`` what goes to the right in place of time (``east, m``), and both axes
    to one scale; ``over`` is what goes to the right on a logarithmic axis in place of time (``step, s``).
    ``marks`` are instants, in the unit of the axis, at which something begins, and its name.
    """

    key: str
    section: str
    title: str
    time_unit: str
    panels: tuple[Panel, ...]
    note: str = ""
    span: tuple[float, float] | None = None
    across: str = ""
    over: str = ""
    marks: tuple[tuple[float, str], ...] = ()

    @property
    def horizontal(self) -> str:
        """Title of the horizontal axis."""
        return self.across or self.over or f"time, {self.time_unit}"


def thinned(time: FloatArray, columns: tuple[FloatArray, ...], limit: int) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """Time and columns at the rows that carry their outline (`kept_rows`)."""
    rows = kept_rows(np.column_stack(columns), limit)
    return time[rows], tuple(column[rows] for column in columns)


def focused(*columns: tuple[FloatArray, FloatArray]) -> tuple[float, float] | None:
    """A vertical range without the first fifth of the run, where that makes the rest 3.5 times larger or more.

    ``columns`` are (time, values), (N,) each; N may differ from one to the next.

    A filter that starts at 10 deg and ends at 0.05 deg is a flat line otherwise.
    """
    full = _range(*(values for _, values in columns))
    if full is None or columns[0][0].size < 3:
        return None
    start, end = columns[0][0][0], columns[0][0][-1]
    late = _range(*(values[time >= start + SETTLED * (end - start)] for time, values in columns))
    if late is None or full[1] - full[0] < OFF_SCALE * (late[1] - late[0]) or late[1] == late[0]:
        return None
    margin = 0.15 * (late[1] - late[0])
    return late[0] - margin, late[1] + margin


def slug(text: str) -> str:
    """The text as a part of a file name."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", text).strip("_") or "unnamed"


def _range(*columns: FloatArray) -> tuple[float, float] | None:
    values = np.concatenate(columns)
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if values.size else None
