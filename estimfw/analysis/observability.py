"""Observability of a frozen pair (F, H): rank, unobservable directions, degrees, and what to delete.

Everything is done in coordinates whitened by the prior, x = L u with P0 = L L^T, so that units play no part. The observable
row space is built a direction at a time (H, then H F, H F^2 ... , each direction normalised before it is judged), which
keeps couplings apart whose size differs by ten decades.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["FrozenObservability", "frozen_observability", "least_determined_removable"]

FloatArray = NDArray[np.float64]

#: A new direction whose part outside the known ones is smaller than this (of 1) counts as none.
TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class FrozenObservability:
    """What a frozen pair can tell.

    Attributes
    ----------
    rank : int
    kernel : (n, n - rank) array
        Unobservable directions, as columns in the states' units, scaled to one prior sigma.
    degree : (n,) array
        Prior sigma of each state conditioned on perfect knowledge of the observable part, over its prior sigma:
        0 determined, 1 not at all. Independent of R and of the run's length.
    """

    rank: int
    kernel: FloatArray
    degree: FloatArray


def frozen_observability(F: FloatArray, H: FloatArray, covariance: FloatArray) -> FrozenObservability:
    """Analyse x' = F x, z = H x.

    Parameters
    ----------
    F : (n, n) array
    H : (m, n) array
    covariance : (n, n) array
        The prior. States with zero prior sigma count with sigma 1 in their unit.

    Returns
    -------
    FrozenObservability
    """
    root = _root(covariance)
    inverse = np.linalg.inv(root)
    basis = _row_space(inverse @ F @ root, H @ root)
    projector = np.eye(F.shape[0]) - basis.T @ basis
    values, vectors = np.linalg.eigh(projector)
    null = vectors[:, values > 0.5]
    kernel = root @ null
    sigma = np.linalg.norm(root, axis=1)
    degree = np.linalg.norm(kernel, axis=1) / sigma
    return FrozenObservability(basis.shape[0], kernel, degree)


def _root(covariance: FloatArray) -> FloatArray:
    sigma = np.sqrt(np.diag(covariance))
    sigma = np.where(sigma > 0.0, sigma, 1.0)
    correlation = covariance / np.outer(sigma, sigma)
    np.fill_diagonal(correlation, 1.0)
    values, vectors = np.linalg.eigh(correlation)
    half: FloatArray = vectors * np.sqrt(np.clip(values, 1e-12, None))
    if np.array_equal(correlation, np.eye(len(sigma))):
        half = np.eye(len(sigma))
    return sigma[:, None] * half


def _row_space(F: FloatArray, H: FloatArray) -> FloatArray:
    n = F.shape[0]
    basis = np.zeros((0, n))
    queue = [row for row in H if np.any(row)]
    floor = np.finfo(float).eps * max(float(np.linalg.norm(F)), 1e-300)
    while queue and basis.shape[0] < n:
        row = queue.pop(0)
        row = row / np.linalg.norm(row)
        rest = row - basis.T @ (basis @ row)
        rest -= basis.T @ (basis @ rest)
        size = float(np.linalg.norm(rest))
        if size < TOLERANCE:
            continue
        direction = rest / size
        basis = np.vstack([basis, direction])
        onward = direction @ F
        if np.linalg.norm(onward) > floor:
            queue.append(onward)
    return basis


def least_determined_removable(
    found: FrozenObservability, covariance: FloatArray, protected: Sequence[bool]
) -> list[int] | None:
    """The states to delete so that the rest is observable, least determined first.

    Deleting a set S of states that the others do not drive (biases) leaves an observable rest where the rows S of the kernel
    are independent and as many as its columns; where the others drive them, look at the rank of the rest. Of all such sets
    without protected states the one of the largest sum of degrees is taken (greedy, which is exact for independent rows);
    ties go by state order.

    Returns
    -------
    list of int, in state order, or None if protection leaves no such set
    """
    sigma = np.sqrt(np.diag(covariance))
    scaled = found.kernel / np.where(sigma > 0.0, sigma, 1.0)[:, None]
    order = sorted(range(len(sigma)), key=lambda i: (-round(float(found.degree[i]), 9), i))
    basis = np.zeros((0, scaled.shape[1]))
    chosen: list[int] = []
    for i in order:
        norm = float(np.linalg.norm(scaled[i]))
        if protected[i] or norm < TOLERANCE:
            continue
        row = scaled[i] / norm
        rest = row - basis.T @ (basis @ row)
        rest -= basis.T @ (basis @ rest)
        if np.linalg.norm(rest) < 1e-7:
            continue
        basis = np.vstack([basis, rest / np.linalg.norm(rest)])
        chosen.append(i)
    return sorted(chosen) if len(chosen) == scaled.shape[1] else None
