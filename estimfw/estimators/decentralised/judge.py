"""Whether a measurement is fused: its NIS, its gate, and whether S is to be trusted; by the rules of `estimfw.kernels.fuse`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.decentralised.shares import upper_triangle
from estimfw.estimators.decentralised.work import Arithmetic, Judgement
from estimfw.kernels.fuse import FUSED, GATED, INVALID, MISSING, SINGULAR, decorrelate

__all__ = ["FLOATS", "guarded", "judge", "mirrored", "symmetric_product"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: An update that leaves less than this part of a variance has left rounding.
ROUNDED = 1e-12


def judge(nu: FloatArray, S: FloatArray, R: FloatArray, usable: BoolArray, thresholds: FloatArray | None) -> Judgement:
    """Judge an innovation.

    Parameters
    ----------
    nu, S, R : (m,), (m, m), (m, m) array
    usable : (m,) bool array
    thresholds : (m + 1,) array or None
        See `estimfw.plan.plan.Plan.thresholds`.
    """
    used = int(usable.sum())
    sigma = np.where(usable, np.sqrt(np.abs(S.diagonal())), np.nan)
    innovation = np.where(usable, nu, np.nan)
    if used == 0:
        return Judgement(MISSING, innovation, sigma, np.nan, 0, np.nan)
    own = np.ix_(usable, usable)
    nis, log_det, trusted = _in_sequence(nu[usable], S[own], R[own])
    disposition = FUSED if trusted else INVALID
    if trusted and thresholds is not None and nis > thresholds[used]:
        disposition = GATED
    return Judgement(
        disposition, innovation, sigma, nis, used if disposition == FUSED else 0, log_det if trusted else np.nan
    )


def _in_sequence(nu: FloatArray, S: FloatArray, R: FloatArray) -> tuple[float, float, bool]:
    """NIS, ln det S, and whether no pivot of S is a rounding: as if the rows, their noise decorrelated, came one by one."""
    variance = S.diagonal()
    if len(nu) == 1:
        s, t, r = variance, nu, R.diagonal()
    else:
        r, half, level = decorrelate(R, S, nu[:, None])
        s, rest = decorrelate(decorrelate(R, half.T)[1], level)
        t = rest[:, 0]
    noisy = r > SINGULAR * R.diagonal()
    good = np.isfinite(s) & (s > 0.0) & (noisy | (s > SINGULAR * variance))
    safe = np.where(good, s, 1.0)
    return float(np.sum(np.where(good, t**2 / safe, 0.0))), float(np.sum(np.log(safe))), bool(np.all(good))


def mirrored(A: FloatArray) -> FloatArray:
    """A with its upper triangle mirrored to the lower one."""
    rows, columns = upper_triangle(len(A))
    A[columns, rows] = A[rows, columns]
    return A


def symmetric_product(A: FloatArray, B: FloatArray) -> FloatArray:
    return mirrored(A @ B.T)


def guarded(P: FloatArray, before: FloatArray, K: FloatArray, R: FloatArray) -> FloatArray:
    """P (k, k) after P <- P - K S K', with no variance below what the noise leaves of it, (K R K')_ii.

    Where an update takes all but 1e-12 of a variance, a difference in double precision has not four digits left, or is zero or
    negative: a huge prior under a small noise. See `estimfw.kernels.ud` for a form that has them all.
    """
    after = P.diagonal()
    lost = after < ROUNDED * before.diagonal()
    if not lost.any():
        return P
    least = np.einsum("ij,jk,ik->i", K[lost], R, K[lost])
    P[lost, lost] = np.maximum(after[lost], least)
    return P


def _inverse(S: FloatArray) -> FloatArray:
    return mirrored(np.asarray(np.linalg.inv(S), dtype=float)) if len(S) > 1 else 1.0 / S


FLOATS = Arithmetic(_inverse, symmetric_product, judge, np.zeros, np.isfinite, guarded)
"""The arithmetic of a filter that runs."""
