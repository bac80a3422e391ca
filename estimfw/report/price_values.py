"""What each filter of a comparison gives at given times: value, error, sigma of its own and honest, and what was published."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from estimfw.report.angles import wrapped
from estimfw.run.compare import Comparison
from estimfw.run.published import Published
from estimfw.run.summary import EndValue, end_outputs, end_states, json_attribute
from estimfw.run.until import until

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Given", "unmatched", "values_of"]


@dataclass(frozen=True, slots=True)
class Given:
    """One output (a state, where there are no outputs) of one filter at one time; numbers in the display ``unit``.

    ``error`` is the value minus truth, ``from_first`` minus that of the first filter, ``published`` the published error;
    NaN where unknown. ``honest`` equals ``sigma`` where the model was not approximated.
    """

    point: str
    time: float
    output: str
    filter: str
    value: float
    error: float
    sigma: float
    honest: float
    from_first: float
    unit: str
    published: float = math.nan


def values_of(
    comparison: Comparison, times: Sequence[float] = (), published: Sequence[Published] = ()
) -> tuple[Given, ...]:
    """Every filter's outputs at every point and time (s; none: at the end), filters side by side.

    Published figures belong to the last of the times.

    Raises
    ------
    UsageError
        A time lies outside the run.
    """
    known = {(p.filter, p.value, p.output): p.figure for p in published}
    found: list[Given] = []
    last = max(times, default=math.inf)
    for point, results in zip(comparison.points, comparison.results, strict=True):
        for time in times or (None,):
            cut = [r if time is None else until(r, time) for r in results]
            figures = known if time is None or time == last else {}
            found.extend(_at_time(point.label, comparison, cut, figures))
    return tuple(found)


def unmatched(published: Sequence[Published], values: Sequence[Given]) -> tuple[Published, ...]:
    """Published figures that stand beside none of ours."""
    met = {(v.filter, v.point, v.output) for v in values if math.isfinite(v.published)}
    return tuple(p for p in published if (p.filter, p.value, p.output) not in met)


def _at_time(
    point: str, comparison: Comparison, results: Sequence[xr.Dataset], figures: dict[tuple[str, str, str], float]
) -> Iterator[Given]:
    ends = [_ends(r) for r in results]
    for label, first in ends[0].items():
        for one, end, result in zip(comparison.filters, ends, results, strict=True):
            if label not in end:
                continue
            given = _given(point, one.name, end[label], first, _honest(result, end[label]))
            figure = figures.get((one.name, point, label), math.nan) * end[label].display_scale
            yield replace(given, published=figure)


def _ends(result: xr.Dataset) -> dict[str, EndValue]:
    return {e.label: e for e in (end_outputs(result) or end_states(result))}


def _given(point: str, name: str, end: EndValue, first: EndValue, honest: float) -> Given:
    value, sigma, error = end.display()
    apart = np.array(end.value - first.value)
    turned = wrapped(apart) if "." in end.label and end.unit == "rad" else apart
    scale = end.display_scale
    return Given(
        point, end.time, end.label, name, value, error, sigma, honest * scale, float(turned) * scale, end.display_unit
    )


def _honest(result: xr.Dataset, end: EndValue) -> float:
    """The honest sigma at the time of a value, SI; the filter's own where nothing approximates the model, else NaN if unknown."""
    axis = "output" if end.label in result.coords.get("output", ()) else "state"
    name = "output_honest_sigma" if axis == "output" else "honest_sigma"
    if name not in result:
        policies = json_attribute(result, "policies", [])
        return math.nan if any(one.get("kind") == "approximate" for one in policies) else end.sigma
    row = int(np.searchsorted(result["time"].to_numpy(), end.time))
    column = list(result[axis].to_numpy()).index(end.label)
    return float(result[name].to_numpy()[row, column])
