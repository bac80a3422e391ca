"""What a node is given for a step: the model, which all nodes know, and its own readings; and what it hands back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.decentralised.shares import Snapshot
from estimfw.kernels.fuse import nearest

__all__ = ["Arithmetic", "Done", "Judgement", "Readings", "Stage", "Work"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Readings = Mapping[int, FloatArray]
"""z (m,) of each measurement that is due, by its place; NaN where a component is missing."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A measurement that is due.

    ``place`` in the plan, ``owner`` its node, ``H`` (m, n), ``R`` (m, m), ``reads`` (m, n) which states its rows read,
    ``thresholds`` (m + 1,) the largest NIS that is fused, by the number of usable components; None: no gate. ``period`` is that
    of rows that wrap (0: they do not).
    """

    place: int
    owner: int
    H: FloatArray
    R: FloatArray
    reads: BoolArray
    thresholds: FloatArray | None = None
    period: float = 0.0

    def around(self, reading: FloatArray, innovation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Reading and innovation, both moved by the whole periods that make the innovation the shorter way round."""
        if self.period <= 0.0:
            return reading, innovation
        shorter = nearest(innovation, np.zeros(innovation.shape), self.period)
        return reading + (shorter - innovation), shorter


@dataclass(frozen=True, slots=True)
class Work:
    """A step.

    ``transition``: Phi, Q (n, n) and d (n,), None for a step of no length. ``stages``: the measurements that are due and whose
    owner answers, in their order. ``noise``: R between two of them, by their places, the earlier one first.
    """

    transition: tuple[FloatArray, FloatArray, FloatArray] | None
    stages: tuple[Stage, ...]
    noise: Mapping[tuple[int, int], FloatArray] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Judgement:
    """What became of a measurement; arrays (m,), NaN where a component is not usable. See `estimfw.kernels.fuse.Fused`."""

    disposition: int
    innovation: FloatArray
    sigma: FloatArray
    nis: float
    used: int
    log_det: float


@dataclass(frozen=True, slots=True)
class Done:
    """What a node knows after a step, and what became of its measurements, by place."""

    snapshot: Snapshot
    judged: Mapping[int, Judgement]


def _as_it_is(P: FloatArray, before: FloatArray, K: FloatArray, R: FloatArray) -> FloatArray:
    return P


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """The operations of a node that are more than ``+ - * @``, so that it can run on other numbers than floats.

    Attributes
    ----------
    inverse : callable
        Of a symmetric S.
    symmetric : callable
        ``A @ B'`` where that is symmetric: the same above and below the diagonal to the last bit.
    judge : callable
        ``judge(nu, S, R, usable, thresholds)``, all of them (m,), (m, m).
    zeros : callable
        Array of zeros of a shape.
    finite : callable
        Which numbers of a reading there are.
    guard : callable
        ``guard(P, before, K, R)``: a node's own covariance after an update, where rounding may have left nothing of it.
    """

    inverse: Callable[[FloatArray], FloatArray]
    symmetric: Callable[[FloatArray, FloatArray], FloatArray]
    judge: Callable[[FloatArray, FloatArray, FloatArray, BoolArray, FloatArray | None], Judgement]
    zeros: Callable[[tuple[int, ...]], FloatArray]
    finite: Callable[[FloatArray], BoolArray]
    guard: Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray] = _as_it_is
