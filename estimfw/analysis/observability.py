"""Observability of a linear system that is constant over stretches of time: rank, unobservable directions, degrees.

One stretch is the frozen pair (F, H). Of several the total observability matrix is taken, with the transitions in between:
``[Q1; Q2 e^(F1 T1); Q3 e^(F2 T2) e^(F1 T1); ...]`` with ``Qj = [Hj; Hj Fj; ...]``, all about the state at the start
(Goshen-Meskin and Bar-Itzhack, "Observability analysis of piece-wise constant systems, part I", IEEE Trans. AES 28, 1992).

Everything is done in coordinates whitened by the prior, see `estimfw.analysis.whitening` and `estimfw.analysis.row_space`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.row_space import RowSpace, Spectrum
from estimfw.analysis.whitening import whitening
from estimfw.errors import NumericalError

__all__ = ["LinearStretch", "Observability", "frozen_observability", "is_observable_without", "piecewise_observability"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LinearStretch:
    """x' = F x, z = H x over ``duration`` s: F (n, n), H (m, n)."""

    F: FloatArray
    H: FloatArray
    duration: float = 0.0


@dataclass(frozen=True, slots=True)
class Observability:
    """What measurements can tell of the state at the start.

    Attributes
    ----------
    rank : int
    kernel : (n, n - rank) array
        Unobservable directions, as columns in the states' units, scaled to one prior sigma.
    degree : (n,) array
        Prior sigma of each state conditioned on perfect knowledge of the observable part, over its prior sigma:
        0 determined, 1 not at all. Independent of R and of the run's length.
    spectrum : Spectrum
        How clear the rank is.
    added : tuple of (n, k) arrays
        For each stretch the directions that it makes observable and those before it did not, as `kernel` has them.
    """

    rank: int
    kernel: FloatArray
    degree: FloatArray
    spectrum: Spectrum
    added: tuple[FloatArray, ...]


def frozen_observability(F: FloatArray, H: FloatArray, covariance: FloatArray) -> Observability:
    """Analyse x' = F x, z = H x.

    Parameters
    ----------
    F : (n, n) array
    H : (m, n) array
    covariance : (n, n) array
        The prior. States with zero prior sigma count with sigma 1 in their unit.

    Returns
    -------
    Observability
    """
    return piecewise_observability([LinearStretch(F, H)], covariance)


def piecewise_observability(stretches: Sequence[LinearStretch], covariance: FloatArray) -> Observability:
    """Analyse stretches that follow one another; ``covariance`` (n, n) is the prior at the start of the first."""
    root = whitening(covariance)
    space, ends = _row_space(stretches, root)
    values, vectors = np.linalg.eigh(np.eye(root.shape[0]) - space.basis.T @ space.basis)
    kernel = root @ vectors[:, values > 0.5]
    degree = np.linalg.norm(kernel, axis=1) / np.linalg.norm(root, axis=1)
    edges = [0, *ends]
    added = tuple(root @ space.basis[a:b].T for a, b in pairwise(edges))
    return Observability(space.rank, kernel, degree, space.spectrum, added)


def is_observable_without(stretches: Sequence[LinearStretch], covariance: FloatArray, gone: Sequence[int]) -> bool:
    """Whether the rest is observable when states are deleted: their rows and columns of F and H, the prior's marginal."""
    kept = np.setdiff1d(np.arange(covariance.shape[0]), gone)
    own = np.ix_(kept, kept)
    rest = [LinearStretch(s.F[own], s.H[:, kept], s.duration) for s in stretches]
    return _row_space(rest, whitening(covariance[own]))[0].is_full


def _row_space(stretches: Sequence[LinearStretch], root: FloatArray) -> tuple[RowSpace, list[int]]:
    """The row space about the start, in whitened states, and its rank after each stretch."""
    from scipy.linalg import expm

    inverse, n = np.linalg.inv(root), root.shape[0]
    space, ends = RowSpace(n), []
    transition: FloatArray | None = None
    for stretch in stretches:
        F, H = inverse @ stretch.F @ root, stretch.H @ root
        if transition is None:
            space.add_derivatives(F, H)
            transition = np.eye(n)
        elif not space.is_full:
            own = RowSpace(n)
            own.add_derivatives(F, H)
            for row in own.basis @ transition:
                space.add(row)
        ends.append(space.rank)
        if stretch is not stretches[-1] and not space.is_full:
            transition = _finite(expm(F * stretch.duration) @ transition, stretch.duration)
    return space, ends


def _finite(transition: FloatArray, duration: float) -> FloatArray:
    if not np.all(np.isfinite(transition)):
        raise NumericalError(
            f"the dynamics grow beyond all numbers over a stretch of {duration:g} s of the record",
            hint="they are unstable; shorten the record",
        )
    return transition
