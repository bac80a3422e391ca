"""The figure that a part of a claim is about, from the results of the filters that it names."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME
from estimfw.errors import UsageError
from estimfw.run.claim_file import Part

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["figure_of", "unit_of"]

FloatArray = NDArray[np.float64]

#: Variables of a result by statistic: of a state, of an output.
VARIABLES = {
    "sigma": ("sigma", "output_sigma"),
    "honest_sigma": ("honest_sigma", "output_honest_sigma"),
    "error": ("error", "output_error"),
}


def figure_of(part: Part, results: Mapping[str, xr.Dataset]) -> float:
    """The figure, in the display unit of its quantity or as a plain number.

    Raises
    ------
    UsageError
        A quantity, a statistic or an instant that a result does not have.
    """
    figures = [_of_one(part, name, results[name]) for name in part.of]
    if len(figures) == 1:
        return figures[0]
    return figures[0] / figures[1] if figures[1] else float("inf")


def unit_of(part: Part, results: Mapping[str, xr.Dataset]) -> str:
    """The unit of the figure; empty for a plain number."""
    if part.statistic not in VARIABLES or part.since is not None or len(part.of) == 2:
        return ""
    dataset = results[part.of[0]]
    axis, i = _place(part, part.of[0], dataset)
    return str(dataset[f"{axis}_display_unit"].to_numpy()[i])


def _of_one(part: Part, name: str, dataset: xr.Dataset) -> float:
    if part.statistic == "undetermined":
        return float(len(json.loads(str(dataset.attrs.get("undetermined", "[]")))))
    time, end = dataset["time"].to_numpy(), part.at
    last = _row(time, end, name) if end is not None else time.size - 1
    if part.statistic in ("exponent", "turns"):
        first = _row(time, max(float(part.since or 0.0), float(time[0])), name)
        sigma = _series(part, "sigma", name, dataset)
        stretch = slice(first, last + 1)
        if part.statistic == "turns":
            return float(turns(sigma[stretch]))
        return exponent(time[stretch], sigma[stretch], _at_start(part, name, dataset))
    now = _value(part, name, dataset, last)
    if part.since is None:
        return now
    if part.since < time[0] - SAME:
        then = _at_start(part, name, dataset) if part.statistic != "overconfidence" else 1.0
    else:
        then = _value(part, name, dataset, _row(time, part.since, name))
    return now / then if then else float("inf")


def exponent(time: FloatArray, sigma: FloatArray, start: float) -> float:
    """The p of sqrt(sigma^2 - start^2) ~ t^p over these instants (K,), by least squares in logarithms."""
    gained = sigma**2 - start**2
    grown = gained > 0.0
    if grown.sum() < 2:
        return float("nan")
    slope = np.polyfit(np.log(time[grown]), 0.5 * np.log(gained[grown]), 1)[0]
    return float(slope)


def turns(values: FloatArray) -> int:
    """How often a series (K,) turns; steps that are rounding do not count."""
    change = np.diff(values)
    signs = np.sign(change[np.abs(change) > 1e-12 * np.abs(values[1:])])
    return int(np.count_nonzero(np.diff(signs)))


def _value(part: Part, name: str, dataset: xr.Dataset, row: int) -> float:
    if part.statistic == "overconfidence":
        own = _series(part, "sigma", name, dataset)[row]
        return float(_series(part, "honest_sigma", name, dataset)[row] / own) if own else float("inf")
    return float(abs(_series(part, part.statistic, name, dataset)[row]))


def _at_start(part: Part, name: str, dataset: xr.Dataset) -> float:
    """The sigma that the filter starts with, in the display unit."""
    axis, i = _place(part, name, dataset)
    if axis != "state" or part.statistic == "error":
        raise UsageError(
            f"{part.text!r}: what {part.quantity} of {name} was at the start is not known",
            hint=f"say since: {float(dataset['time'][0]):g} s, the end of the first step, or later",
        )
    return float(dataset["prior_sigma"].to_numpy()[i] * dataset["state_display_scale"].to_numpy()[i])


def _series(part: Part, statistic: str, name: str, dataset: xr.Dataset) -> FloatArray:
    """(K,) in the display unit."""
    axis, i = _place(part, name, dataset)
    variable = VARIABLES[statistic][axis == "output"]
    if statistic == "honest_sigma" and variable not in dataset:
        variable = VARIABLES["sigma"][axis == "output"]  # nothing was reduced: it is honest
    if variable not in dataset:
        told = "no truth is known" if statistic == "error" else "it estimates no states"
        raise UsageError(f"{part.text!r}: {name} has no {statistic}", hint=told)
    scale = float(dataset[f"{axis}_display_scale"].to_numpy()[i])
    return np.asarray(dataset[variable].to_numpy()[:, i] * scale, dtype=float)


def _place(part: Part, name: str, dataset: xr.Dataset) -> tuple[str, int]:
    for axis in ("state", "output"):
        labels = [str(x) for x in dataset[axis].to_numpy()] if axis in dataset.coords else []
        if part.quantity in labels:
            return axis, labels.index(part.quantity)
    there = [str(x) for axis in ("state", "output") if axis in dataset.coords for x in dataset[axis].to_numpy()]
    raise UsageError(f"{part.text!r}: {name} has no {part.quantity!r}", hint=f"there are {', '.join(there)}")


def _row(time: FloatArray, at: float, name: str) -> int:
    if not time[0] - SAME <= at <= time[-1] + SAME:
        raise UsageError(
            f"{at:.10g} s lies outside the run of {name}", hint=f"it goes from {time[0]:.10g} to {time[-1]:.10g} s"
        )
    return int(np.argmin(np.abs(time - at)))
