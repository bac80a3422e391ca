"""Cut the states of a filter into groups so that what belongs together most stays together.

Given weights w_ij = w_ji >= 0 (the size of a correlation, or of a physical coupling), the groups maximise
J = sum over groups of sum over i < j in the group of w_ij, for given sizes. The states that one row of a measurement reads stay
together, since a row belongs to one group; rows that share a state are merged. Where there are as many such *seeds* as groups,
or fewer, no two of them are in one group; where there are more, each group has one at least.

Estimates and work of the exact filter do not depend on the groups, but for their sizes and for whether rows read one group.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.partition_search import Atoms, all_partitions, greedy_partition
from estimfw.errors import ConfigError

__all__ = ["Cut", "best_cut", "correlation", "objective", "seeds_of"]

FloatArray = NDArray[np.float64]
Groups = tuple[tuple[int, ...], ...]

#: Branches that an exact search may look at; more take the greedy search.
MOST_BRANCHES = 400_000


@dataclass(frozen=True, slots=True)
class Cut:
    """Groups of states, each in order, and the groups in the order of their first states.

    Attributes
    ----------
    groups : tuple of tuple of int
    objective : float
        J.
    runner_up : tuple of tuple of int, or None
        The next best groups; of a greedy search the best that one exchange makes of ``groups``; None: there are no others.
    runner_up_objective : float
        NaN without one.
    cases : int
        How many partitions an exact search compared; 0: the search was greedy.
    """

    groups: Groups
    objective: float
    runner_up: Groups | None
    runner_up_objective: float
    cases: int

    @property
    def exact(self) -> bool:
        return self.cases > 0


def correlation(P: FloatArray) -> FloatArray:
    """rho_ij = P_ij / sqrt(P_ii P_jj) of a covariance (n, n); a state without variance is correlated with nothing."""
    sigma = np.sqrt(np.maximum(np.diag(P), 0.0))
    scale = np.divide(1.0, sigma, out=np.zeros_like(sigma), where=sigma > 0.0)
    return np.asarray(P * scale[:, None] * scale)


def objective(weights: FloatArray, groups: Sequence[Sequence[int]]) -> float:
    """J of groups; ``weights`` (n, n) is symmetric, its diagonal does not count."""
    inside = (weights[np.ix_(list(g), list(g))] for g in groups)
    return float(sum((w.sum() - np.trace(w)) / 2.0 for w in inside))


def seeds_of(reads: Sequence[Sequence[int]]) -> Groups:
    """States that stay together, by what each row of the measurements reads; rows that share a state are one."""
    seeds: list[set[int]] = []
    for row in map(set, reads):
        apart = [s for s in seeds if not s & row]
        seeds = [*apart, row.union(*(s for s in seeds if s & row))] if row else seeds
    return tuple(sorted(tuple(sorted(s)) for s in seeds))


def best_cut(weights: FloatArray, sizes: Sequence[int], seeds: Sequence[Sequence[int]], *, exact: bool = True) -> Cut:
    """The groups of largest J.

    Parameters
    ----------
    weights : (n, n) array
        Symmetric, not negative.
    sizes : sequence of int
        Of the groups, in any order; they add up to n.
    seeds : sequence of sequence of int
        See `seeds_of`.
    exact : bool
        Compare all partitions where that ends soon; else, and with False, a greedy search with exchanges.

    Raises
    ------
    ConfigError
        Seeds do not fit into groups of these sizes.
    """
    atoms = Atoms.of(weights, seeds)
    wanted = sorted(sizes, reverse=True)
    found = all_partitions(atoms, wanted, MOST_BRANCHES) if exact else None
    found = found or greedy_partition(atoms, wanted)
    if found.best is None:
        raise ConfigError(
            f"states that are read together do not fit into groups of {', '.join(map(str, wanted))}",
            hint=f"states of one row stay together, here {', '.join(str(len(s)) for s in seeds)}; other sizes, or fewer groups",
        )
    best = atoms.states(found.best)
    second = atoms.states(found.second) if found.second is not None else None
    J = [objective(weights, g) if g is not None else float("nan") for g in (best, second)]
    return Cut(best, J[0], second, J[1], found.cases)
