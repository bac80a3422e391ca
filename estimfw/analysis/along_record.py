"""Observability along the record that was flown: piecewise constant, by the Gramian, and the degree of each state with time.

A restart of the estimator begins anew: what was measured before it is in the corrected nominal, not in the states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.degree import Degrees, observable_part, posterior_over_prior
from estimfw.analysis.gramian import Gramian, GramianValues
from estimfw.analysis.mean_stretch import MeanStretch
from estimfw.analysis.observability import LinearStretch, Observability, piecewise_observability
from estimfw.analysis.whitening import whitening
from estimfw.estimators.stretch import Stretch

__all__ = ["AlongRecord", "Segment", "Watch", "may_be_stripped"]

FloatArray = NDArray[np.float64]

#: A combination whose sigma the measurements shrink by less than 0.5 % (of a whitened Gramian) counts as unseen.
UNSEEN = 0.1


@dataclass(frozen=True, slots=True)
class Segment:
    """A part of the record, from ``start`` to ``end`` (s), frozen at its mean.

    ``begins_anew``: the estimator started here. ``gramian`` is that from the last start to the end of the segment; ``rank``
    that of the segments from the last start up to this one, taken as piecewise constant.
    """

    start: float
    end: float
    begins_anew: bool
    frozen: LinearStretch
    gramian: GramianValues
    rank: int


@dataclass(frozen=True, slots=True)
class AlongRecord:
    """What the record tells.

    Attributes
    ----------
    segments : tuple of Segment
    piecewise, seen : Observability
        Of the segments since the last start; and by the Gramian, where combinations that it hardly sees (`UNSEEN`) count as
        unobservable.
    degrees : Degrees
    stripped : bool
        The transitions between segments may be left out (the stripped observability matrix has the same null space).
    """

    segments: tuple[Segment, ...]
    piecewise: Observability
    seen: Observability
    degrees: Degrees
    stripped: bool


@dataclass
class _Part:
    """From a start of the estimator to the next."""

    gramian: Gramian
    frozen: list[tuple[int, LinearStretch]]
    values: list[GramianValues]
    instants: list[int]
    transitions: list[FloatArray]


class Watch:
    """Sees the stretches of a run in order (`estimfw.estimators.stretch.Watcher`), then tells.

    Parameters
    ----------
    time, dt : (K,) arrays, s
        Ends and lengths of all steps of the run.
    restart : (K,) array of bool
    prior : (n, n) array
        Covariance at each start.
    segments : int
        Pieces of equal length in time.
    instants : (T,) array of int
        Steps at whose end the degrees are wanted.
    """

    def __init__(
        self, time: FloatArray, dt: FloatArray, restart: NDArray[np.bool_], prior: FloatArray, segments: int,
        instants: NDArray[np.int64],
    ) -> None:  # fmt: skip
        self._time, self._dt, self._restart, self._prior = time, dt, restart, prior
        self._root = whitening(prior)
        begin = time[0] - dt[0]
        wanted = begin + (time[-1] - begin) * np.arange(1, segments) / segments
        cuts = {0, len(time), *np.flatnonzero(restart).tolist(), *np.searchsorted(time, wanted, side="right").tolist()}
        self._edges = sorted(cuts)
        self._instants = instants
        self._first, self._parts = 0, list[_Part]()
        self._sums = MeanStretch()
        self._covariances: list[FloatArray] = []

    def __call__(self, stretch: Stretch) -> None:
        """Take in the next stretch."""
        plan, chunk = stretch.plan, stretch.chunk
        process, end = stretch.rows
        Phi, _, _ = plan.transitions(process, chunk.inputs, chunk.dt, stretch.doublings)
        H, R, usable = plan.design(end), plan.noise(chunk.interval), stretch.usable
        F = plan.F.evaluate(process[:1] if plan.time_invariant else process)
        F = np.broadcast_to(F, Phi.shape)
        last = self._first + len(stretch)
        bounds = [self._first, *(e for e in self._edges if self._first < e < last), last]
        for a, b in pairwise(bounds):
            own = slice(a - self._first, b - self._first)
            self._take(a, b, Phi[own], F[own], H[own], R[own], usable[own])
        inside = self._instants[(self._instants >= self._first) & (self._instants < last)] - self._first
        self._covariances += list(stretch.result.covariance[inside])
        self._first = last

    def _take(
        self, a: int, b: int, Phi: FloatArray, F: FloatArray, H: FloatArray, R: FloatArray, usable: NDArray[np.bool_]
    ) -> None:
        if a == 0 or self._restart[a]:
            self._parts.append(_Part(Gramian(self._root), [], [], [], []))
        part = self._parts[-1]
        along = part.gramian.add(Phi, H, R, usable)
        inside = self._instants[(self._instants >= a) & (self._instants < b)]
        part.instants += inside.tolist()
        part.transitions += list(along[inside - a])
        self._sums.add(F, H, usable)
        if b in self._edges:
            begin = max(e for e in self._edges if e < b)
            duration = float(self._dt[begin:b].sum())
            part.frozen.append((begin, self._sums.mean(duration)))
            part.values.append(part.gramian.values())
            self._sums = MeanStretch()

    def tell(self, *, kernel: FloatArray | None) -> AlongRecord:
        """The findings, after the last stretch.

        Parameters
        ----------
        kernel : (n, u) array or None
            The unobservable directions of a time-invariant plan; else those that the Gramian hardly sees are taken.
        """
        segments: list[Segment] = []
        for part in self._parts:
            found = piecewise_observability([s for _, s in part.frozen], self._prior)
            ranks = np.cumsum([a.shape[1] for a in found.added])
            for (begin, frozen), values, rank in zip(part.frozen, part.values, ranks, strict=True):
                start = round(float(self._time[begin] - self._dt[begin]), 9)
                end = round(start + frozen.duration, 9)
                segments.append(Segment(start, end, begin == part.frozen[0][0], frozen, values, int(rank)))
        last = [s for _, s in self._parts[-1].frozen]
        return AlongRecord(
            segments=tuple(segments),
            piecewise=found,
            seen=self._seen(self._parts[-1].values[-1], found),
            degrees=self._degrees(kernel),
            stripped=may_be_stripped(last, self._prior),
        )

    def _seen(self, values: GramianValues, found: Observability) -> Observability:
        unseen = self._root @ values.directions[values.singular <= UNSEEN].T
        degree = np.linalg.norm(unseen, axis=1) / np.linalg.norm(self._root, axis=1)
        return Observability(values.singular.size - unseen.shape[1], unseen, degree, found.spectrum, ())

    def _degrees(self, kernel: FloatArray | None) -> Degrees:
        parts = []
        for part in self._parts:
            if kernel is not None:
                parts += [kernel] * len(part.instants)
            else:
                values = part.values[-1]
                unseen = values.directions[values.singular <= UNSEEN].T
                parts += [A @ unseen for A in part.transitions]
        conditioned = [observable_part(P, N, self._root) for P, N in zip(self._covariances, parts, strict=True)]
        posterior = [posterior_over_prior(P, self._prior) for P in self._covariances]
        return Degrees(self._time[self._instants], np.array(posterior), np.array(conditioned))


def may_be_stripped(stretches: Sequence[LinearStretch], covariance: FloatArray) -> bool:
    """Whether in each segment what it does not see stays as it is (Goshen-Meskin and Bar-Itzhack, theorem 2).

    Then ``[Q1; Q2; ...]`` has the null space of the total observability matrix.
    """
    root = whitening(covariance)
    inverse = np.linalg.inv(root)
    for one in stretches:
        kernel = inverse @ piecewise_observability([LinearStretch(one.F, one.H)], covariance).kernel
        F = inverse @ one.F @ root
        if kernel.size and np.linalg.norm(F @ kernel) > 1e-9 * max(float(np.linalg.norm(F)), 1e-300):
            return False
    return True
