"""What the errors of a filter come from: the initial errors, the noises of the process, those of the measurements.

Sources are independent of each other, so their contributions to a mean square add up. Initial errors that are correlated are one
source.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from estimfw.plan.plan import Plan
from estimfw.plan.truth_plan import TruthPlan

__all__ = ["Source", "all_sources", "single_sources"]

FloatArray = NDArray[np.float64]
Kind = Literal["all", "initial error", "process noise", "measurement noise", "known values"]


@dataclass(frozen=True)
class Source:
    """One source, or all in one.

    Attributes
    ----------
    kind : str
    name : str
        Labels of what it is.
    initial : (N, N) array
        Second moments that it brings to the joint state at the start, see `estimfw.analysis.dual_covariance`.
    noises : tuple of int, or 'all'
        Noise inputs of the truth plan.
    readings : tuple of int, or 'all'
        Rows of the filter's measurements, one behind the other.
    """

    kind: Kind
    name: str
    initial: FloatArray
    noises: tuple[int, ...] | Literal["all"] = ()
    readings: tuple[int, ...] | Literal["all"] = ()


def all_sources(mean: FloatArray, covariance: FloatArray, map: FloatArray, own_mean: FloatArray) -> tuple[Source, ...]:
    """All in one, for the total.

    Parameters
    ----------
    mean, covariance : (a,) and (a, a) array
        Of the truth states at the start.
    map : (n, a) array
        Filter states = map @ truth states.
    own_mean : (n,) array
        What the filter begins with.
    """
    known = _known(mean, map, own_mean)
    return (Source("all", "all", _joint(covariance, map) + np.outer(known, known), "all", "all"),)


def single_sources(
    truth: TruthPlan, of: Plan, mean: FloatArray, covariance: FloatArray, map: FloatArray, own_mean: FloatArray
) -> tuple[Source, ...]:
    """Each on its own; parameters as for `all_sources`."""
    size = covariance.shape[0] + map.shape[0] + 1
    nothing = np.zeros((size, size))
    made = []
    for group in _groups(covariance):
        alone = np.zeros_like(covariance)
        alone[np.ix_(group, group)] = covariance[np.ix_(group, group)]
        if np.any(alone):
            name = " + ".join(truth.plan.states[i] for i in group)
            made.append(Source("initial error", name, _joint(alone, map)))
    made.extend(Source("process noise", label, nothing, noises=(i,)) for i, (label, _) in enumerate(truth.noises))
    at = 0
    for m in of.measurements:
        for group in _groups(np.array(m.R)):
            name = " + ".join(m.labels[i] for i in group)
            made.append(Source("measurement noise", name, nothing, readings=tuple(at + i for i in group)))
        at += m.rows
    known = _known(mean, map, own_mean)
    if np.any(known[:-1]) or truth.plan.inputs:
        made.append(Source("known values", "means of the prior and known inputs", np.outer(known, known)))
    return tuple(made)


def _groups(covariance: FloatArray) -> list[list[int]]:
    """Positions that are correlated with each other."""
    count, label = connected_components(covariance != 0.0, directed=False)
    return [[int(i) for i in np.flatnonzero(label == k)] for k in range(count)]


def _joint(covariance: FloatArray, map: FloatArray) -> FloatArray:
    spread = np.vstack([np.eye(map.shape[1]), map, np.zeros((1, map.shape[1]))])
    return np.asarray(spread @ covariance @ spread.T)


def _known(mean: FloatArray, map: FloatArray, own_mean: FloatArray) -> FloatArray:
    return np.concatenate([mean, map @ mean - own_mean, [1.0]])
