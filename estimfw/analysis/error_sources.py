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
    initial : (N, columns) array
        What it brings to the joint state at the start (see `estimfw.analysis.dual_covariance`): a factor of its second moments.
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
    known = _known(mean, map, own_mean)[:, None]
    return (Source("all", "all", np.hstack([_joint(covariance, map), known]), "all", "all"),)


def single_sources(
    truth: TruthPlan, of: Plan, mean: FloatArray, covariance: FloatArray, map: FloatArray, own_mean: FloatArray
) -> tuple[Source, ...]:
    """Each on its own; parameters as for `all_sources`."""
    nothing = np.zeros((covariance.shape[0] + map.shape[0] + 1, 0))
    made = []
    for group in _groups(covariance):
        alone = np.zeros_like(covariance)
        alone[np.ix_(group, group)] = covariance[np.ix_(group, group)]
        if np.any(alone):
            name = " + ".join(truth.plan.states[i] for i in group)
            made.append(Source("initial error", name, _joint(alone, map)))
    made.extend(Source("process noise", label, nothing, noises=(i,)) for i, (label, _) in enumerate(truth.noises))
    labels = [label for m in of.measurements for label in m.labels]
    for group in _groups(truth.noise(np.ones((1, len(of.measurements))))[0]):
        name = " + ".join(labels[i] for i in group)
        made.append(Source("measurement noise", name, nothing, readings=tuple(group)))
    known = _known(mean, map, own_mean)
    if np.any(known[:-1]) or of.inputs:
        made.append(Source("known values", "means of the prior and known inputs", known[:, None]))
    return tuple(made)


def _groups(covariance: FloatArray) -> list[list[int]]:
    """Positions that are correlated with each other."""
    count, label = connected_components(covariance != 0.0, directed=False)
    return [[int(i) for i in np.flatnonzero(label == k)] for k in range(count)]


def _joint(covariance: FloatArray, map: FloatArray) -> FloatArray:
    """A factor (N, columns) of what errors of this covariance bring to the joint state."""
    sigma = np.sqrt(np.diag(covariance))
    unit = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    live = values > 1e-15
    factor = unit[:, None] * vectors[:, live] * np.sqrt(values[live])
    return np.vstack([factor, map @ factor, np.zeros((1, factor.shape[1]))])


def _known(mean: FloatArray, map: FloatArray, own_mean: FloatArray) -> FloatArray:
    return np.concatenate([mean, map @ mean - own_mean, [1.0]])
