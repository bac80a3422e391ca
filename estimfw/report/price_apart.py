"""How far apart the filters of a comparison are over the whole run: estimates in sigmas, and sigmas, against the first filter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimfw.report.numbers import plain, significant
from estimfw.report.tables import Cell, Table
from estimfw.run.compare import Comparison

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Apart", "apart_from_first", "apart_table", "common_states"]

FloatArray = NDArray[np.float64]

#: Filters that differ by less than this, of a sigma and relative, are one filter by two roads: what is left is rounding.
SAME_FILTER = 1e-6
TOLD = "Over the whole run and all states that both have; estimates in σ of the first filter, σ relative to the first filter's."


@dataclass(frozen=True, slots=True)
class Apart:
    """The largest differences of one filter from the first, over all steps and common states, with the state and the time (s).

    ``estimate`` is |x - x_first| / sigma_first, ``sigma`` is |sigma / sigma_first - 1|.
    """

    point: str
    filter: str
    estimate: float
    estimate_at: tuple[str, float]
    sigma: float
    sigma_at: tuple[str, float]
    states: int

    @property
    def same(self) -> bool:
        return max(self.estimate, self.sigma) < SAME_FILTER


def common_states(results: tuple[xr.Dataset, ...]) -> list[str]:
    """States of the first result that another one has too, in its order."""
    others = {str(s) for r in results[1:] for s in r["state"].to_numpy()}
    return [str(s) for s in results[0]["state"].to_numpy() if str(s) in others]


def apart_from_first(comparison: Comparison) -> tuple[Apart, ...]:
    """Each filter but the first, at each point; none where it shares no state with the first, or has other epochs."""
    found = []
    for point, results in zip(comparison.points, comparison.results, strict=True):
        for one, result in zip(comparison.filters[1:], results[1:], strict=True):
            states = common_states((results[0], result))
            if states and np.array_equal(results[0]["time"].to_numpy(), result["time"].to_numpy()):
                found.append(_apart(point.label, one.name, results[0], result, states))
    return tuple(found)


def _apart(point: str, name: str, first: xr.Dataset, other: xr.Dataset, states: list[str]) -> Apart:
    x, sigma = (_of(first, variable, states) for variable in ("estimate", "sigma"))
    y, its = (_of(other, variable, states) for variable in ("estimate", "sigma"))
    with np.errstate(divide="ignore", invalid="ignore"):
        estimates = np.where(sigma > 0.0, np.abs(y - x) / sigma, 0.0)
        sigmas = np.where(sigma > 0.0, np.abs(its / sigma - 1.0), 0.0)
    time = first["time"].to_numpy()
    (most, where), (widest, place) = (_largest(values, states, time) for values in (estimates, sigmas))
    return Apart(point, name, most, where, widest, place, len(states))


def _of(result: xr.Dataset, variable: str, states: list[str]) -> FloatArray:
    every = [str(s) for s in result["state"].to_numpy()]
    return np.asarray(result[variable].to_numpy()[:, [every.index(s) for s in states]], dtype=float)


def _largest(values: FloatArray, states: list[str], time: FloatArray) -> tuple[float, tuple[str, float]]:
    k, i = np.unravel_index(int(np.nanargmax(values)), values.shape)
    return float(values[k, i]), (states[i], float(time[k]))


def apart_table(comparison: Comparison) -> Table | None:
    """A row for each filter but the first; None where there is nothing to set beside each other."""
    rows = apart_from_first(comparison)
    if not rows:
        return None
    varied = any(one.point for one in rows)
    head = (
        *(("varied",) if varied else ()), "filter", "states", "estimates apart, σ", "of", "at, s", "σ apart", "of", "at, s", "",
    )  # fmt: skip
    shift = int(varied)
    cells = tuple(
        (
            *((Cell(one.point),) if varied else ()),
            Cell(one.filter),
            Cell(str(one.states)),
            Cell(significant(one.estimate, 2)),
            Cell(one.estimate_at[0]),
            Cell(plain(one.estimate_at[1])),
            Cell(significant(one.sigma, 2)),
            Cell(one.sigma_at[0]),
            Cell(plain(one.sigma_at[1])),
            Cell("the same filter", "good") if one.same else Cell(""),
        )
        for one in rows
    )
    first = comparison.filters[0].name
    return Table(head, cells, frozenset(shift + i for i in (1, 2, 4, 5, 7)), f"Against {first}. {TOLD}")
