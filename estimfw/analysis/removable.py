"""The minimal sets of states whose removal leaves an observable rest, and which of them is least determined."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.observability import LinearStretch, Observability, is_observable_without
from estimfw.analysis.row_space import TOLERANCE

__all__ = [
    "RemovableSets",
    "independent_states",
    "least_determined",
    "least_determined_removable",
    "removable_sets",
    "undriven",
]

FloatArray = NDArray[np.float64]
States = tuple[int, ...]

#: Rows of sets that are looked at, and sets whose rest is analysed anew, times n^3: some seconds.
MOST_ROWS = 150_000
MOST_WORK = 1e7
#: Independent rows of the kernel, each scaled to 1: the part outside of the others'.
INDEPENDENT = 1e-7


@dataclass(frozen=True, slots=True)
class RemovableSets:
    """``sets`` of positions in state order, minimal, least determined first; ``complete``: all candidates were tried."""

    sets: tuple[States, ...]
    complete: bool
    tried: int


def undriven(stretches: Sequence[LinearStretch]) -> NDArray[np.bool_]:
    """Which states no other state drives in any stretch, (n,): constants, and what only decays by itself."""
    return np.asarray(~np.any(_driving(stretches), axis=1))


def removable_sets(
    found: Observability, stretches: Sequence[LinearStretch], covariance: FloatArray, protected: Sequence[bool]
) -> RemovableSets:
    """Every minimal set of unprotected states, of at most as many as there are unobservable directions.

    Deleting a set that the rest does not drive leaves an observable rest where its rows of the kernel have full column rank,
    for the rest then moves as if the set were zero. Where the rest drives it, the rank of the rest is looked at.

    Parameters
    ----------
    found : Observability
        Of ``stretches``.
    stretches : sequence of LinearStretch
    covariance : (n, n) array
        The prior.
    protected : (n,) sequence of bool
        These are in no set.
    """
    n, unseen = found.kernel.shape
    if not unseen:
        return RemovableSets((), complete=True, tried=0)
    driving, rows = _driving(stretches), _scaled_rows(found, covariance)
    free = [i for i in _order(found.degree) if not protected[i]]
    sets: set[States] = set()
    smaller: list[set[int]] = []
    tried, work, complete = 0, 0, True
    for candidate in _candidates(rows, free, smallest=1 if np.any(driving[free]) else unseen):
        if len(candidate) == n or _is_known(candidate, sets, smaller):
            continue
        if tried * unseen >= MOST_ROWS or work > MOST_WORK:
            complete = False
            break
        tried += 1
        if _is_driven_by_rest(candidate, driving):
            work += n**3 * len(stretches)
            good = is_observable_without(stretches, covariance, candidate)
        else:
            good = len(candidate) == unseen and _independent(rows[list(candidate)])
        if good:
            sets.add(candidate)
            smaller += [set(candidate)] if len(candidate) < unseen else []
    minimal = [s for s in sets if not any(t < set(s) for t in smaller)]
    return RemovableSets(tuple(sorted(minimal, key=lambda s: _place(s, found.degree))), complete, tried)


def least_determined_removable(
    found: Observability, stretches: Sequence[LinearStretch], covariance: FloatArray, protected: Sequence[bool]
) -> States | None:
    """The set to delete: that of `removable_sets` whose states are least determined; None where there is none.

    Of states that no other drives it is found without trying any: they are taken greedily, which is exact for independent rows.
    """
    free = [i for i in _order(found.degree) if not protected[i]]
    if not found.rank:
        return None
    if not np.any(_driving(stretches)[free]):
        return _greedy(_scaled_rows(found, covariance), free)
    return least_determined(removable_sets(found, stretches, covariance, protected).sets, found.degree)


def independent_states(found: Observability, covariance: FloatArray, protected: Sequence[bool] = ()) -> States:
    """For each unobservable direction a state by which it can be told from the others: the least determined ones.

    Empty where the unprotected ones are not enough.
    """
    free = [i for i in _order(found.degree) if not (protected and protected[i])]
    return _greedy(_scaled_rows(found, covariance), free) or ()


def least_determined(sets: Sequence[States], degree: FloatArray) -> States | None:
    """Of these sets the one whose states are least determined, even with perfect knowledge of the observable part.

    Their degrees are compared from the largest on; a tie goes by state order.
    """
    return min(sets, key=lambda s: _place(s, degree), default=None)


def _place(chosen: States, degree: FloatArray) -> tuple[list[float], States]:
    """Least determined first."""
    return sorted(-_rounded(float(degree[i])) for i in chosen), chosen


def _order(degree: FloatArray) -> list[int]:
    """Least determined first."""
    return sorted(range(len(degree)), key=lambda i: (-_rounded(float(degree[i])), i))


def _rounded(degree: float) -> float:
    return round(degree, 9)


def _driving(stretches: Sequence[LinearStretch]) -> NDArray[np.bool_]:
    """Which state (column) drives which other one (row) in any stretch, (n, n)."""
    driving = np.any([s.F != 0.0 for s in stretches], axis=0)
    np.fill_diagonal(driving, False)
    return np.asarray(driving)


def _is_driven_by_rest(chosen: States, driving: NDArray[np.bool_]) -> bool:
    return bool(np.any(np.delete(driving[list(chosen)], chosen, axis=1)))


def _scaled_rows(found: Observability, covariance: FloatArray) -> FloatArray:
    sigma = np.sqrt(np.diag(covariance))
    return np.asarray(found.kernel / np.where(sigma > 0.0, sigma, 1.0)[:, None])


def _candidates(rows: FloatArray, free: Sequence[int], *, smallest: int) -> Iterator[States]:
    """In state order within each: first what is likely to be least determined, then all by size."""
    first = _greedy(rows, free)
    if first is not None:
        yield first
    for size in range(smallest, rows.shape[1] + 1):
        yield from (tuple(sorted(c)) for c in combinations(free, size))


def _is_known(candidate: States, sets: set[States], smaller: Sequence[set[int]]) -> bool:
    """It, or a part of it, is removable already."""
    return candidate in sets or any(known <= set(candidate) for known in smaller)


def _greedy(rows: FloatArray, order: Sequence[int]) -> States | None:
    """The first states in ``order`` whose rows are independent, as many as there are columns; in state order."""
    chosen: list[int] = []
    for i in order:
        if len(chosen) < rows.shape[1] and _independent(rows[[*chosen, i]]):
            chosen.append(i)
    return tuple(sorted(chosen)) if len(chosen) == rows.shape[1] else None


def _independent(rows: FloatArray) -> bool:
    """Whether rows are independent, each scaled to 1; a row of rounding is not."""
    basis = np.zeros((0, rows.shape[1]))
    for row in rows:
        length = float(np.linalg.norm(row))
        if length < TOLERANCE:
            return False
        rest = row / length
        for _ in range(2):
            rest = rest - basis.T @ (basis @ rest)
        outside = float(np.linalg.norm(rest))
        if outside < INDEPENDENT:
            return False
        basis = np.vstack([basis, rest / outside])
    return True
