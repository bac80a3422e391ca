"""One step of the Kalman filter in the forms whose work is compared, on arrays of floats or of numbers that count.

They are definitions, written for reading: what runs is in `estimfw.kernels`. All give the same estimate and covariance. The
decentralised form is run as it is, see `estimfw.analysis.counted_nodes`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["StepArrays", "inverse", "joseph_step", "symmetric_step", "textbook_step"]

Numbers = NDArray[Any]


@dataclass(frozen=True, slots=True)
class StepArrays:
    """What goes into a step: Phi, Q (n, n), z (m,), H (m, n), R (m, m), and x (n,), P (n, n) before it."""

    x: Numbers
    P: Numbers
    Phi: Numbers
    Q: Numbers
    z: Numbers
    H: Numbers
    R: Numbers


def textbook_step(s: StepArrays) -> tuple[Numbers, Numbers]:
    """x and P after it: all rows at once, P <- (I - K H) P."""
    x, P = s.Phi @ s.x, s.Phi @ s.P @ s.Phi.T + s.Q
    M = P @ s.H.T
    K = M @ inverse(s.H @ M + s.R)
    return x + K @ (s.z - s.H @ x), P - (K @ s.H) @ P


def joseph_step(s: StepArrays) -> tuple[Numbers, Numbers]:
    """x and P after it: all rows at once, P <- (I - K H) P (I - K H)' + K R K'."""
    x, P = s.Phi @ s.x, s.Phi @ s.P @ s.Phi.T + s.Q
    M = P @ s.H.T
    K = M @ inverse(s.H @ M + s.R)
    taken = K @ s.H
    left = P - taken @ P
    return x + K @ (s.z - s.H @ x), left - left @ taken.T + (K @ s.R) @ K.T


def symmetric_step(s: StepArrays) -> tuple[Numbers, Numbers]:
    """x and P after it: of P the lower half is computed, rows are taken one by one; R is diagonal."""
    x, half, P = s.Phi @ s.x, s.Phi @ s.P, np.empty_like(s.P)
    lower = [range(i + 1) for i in range(len(x))]
    for i, kept in enumerate(lower):
        _store(P, i, kept, half[i] @ s.Phi[kept].T + s.Q[i, kept])
    for j, h in enumerate(s.H):
        Ph = P @ h
        K = Ph / (h @ Ph + s.R[j, j])
        x = x + K * (s.z[j] - h @ x)
        for i, kept in enumerate(lower):
            _store(P, i, kept, P[i, kept] - K[i] * Ph[kept])
    return x, P


def _store(P: Numbers, i: int, columns: Sequence[int], values: Numbers) -> None:
    """These columns of row i, and their mirror."""
    P[i, columns] = values
    P[columns, i] = values


def inverse(S: Numbers) -> Numbers:
    """Of a positive definite S (m, m), by Gauss and Jordan in place: m^3 products and quotients, no pivot is looked for."""
    A, m = S.copy(), len(S)
    for k in range(m):
        others = [i for i in range(m) if i != k]
        pivot, column = A[k, k], A[others, k]
        row = A[k, others] / pivot
        A[np.ix_(others, others)] = A[np.ix_(others, others)] - np.outer(column, row)
        A[k, others], A[others, k], A[k, k] = row, -column / pivot, 1.0 / pivot
    return A
