"""One vector measurement: innovation, NIS, gate, and the scalars in sequence.

A component that is not usable (NaN) is masked: its row of H, its z and its correlations are zero, its variance one, so it
changes nothing; the rest is fused. A full R is decorrelated by R = L diag(r) L'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

__all__ = ["FUSED", "GATED", "INVALID", "LATE", "MEANINGS", "MISSING", "Fused", "decorrelate", "fuse", "nearest"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FUSED, GATED, LATE, MISSING, INVALID = range(5)
MEANINGS = ("fused", "gated", "late", "missing", "invalid")

#: A pivot of R or S below this part of its diagonal element is a rounding: R is perfect there, S singular.
SINGULAR = 1e-13


@dataclass(frozen=True, slots=True)
class Fused:
    """What became of a measurement: new state, innovation (NaN where masked), its sigma, NIS, disposition, components.

    ``log_det`` is ln det S over the usable components, also of a gated one; NaN where none is usable, or S is not.
    """

    x: FloatArray
    form: FloatArray
    innovation: FloatArray
    sigma: FloatArray
    nis: FloatArray
    disposition: IntArray
    used: IntArray
    log_det: FloatArray


def decorrelate(R: FloatArray, *others: FloatArray) -> tuple[FloatArray, ...]:
    """r with R = L diag(r) L', and L^-1 A for each further array (..., m, k)."""
    A = np.array(R, dtype=float)
    solved = [np.array(o, dtype=float) for o in others]
    m = A.shape[-1]
    r = np.zeros(A.shape[:-1])
    for j in range(m):
        r[..., j] = A[..., j, j]
        live = r[..., j] > 0.0
        for i in range(j + 1, m):
            ell = np.where(live, A[..., i, j] / np.where(live, r[..., j], 1.0), 0.0)
            A[..., i, j + 1 :] -= ell[..., None] * A[..., j, j + 1 :]
            for other in solved:
                other[..., i, :] -= ell[..., None] * other[..., j, :]
    return (r, *solved)


def nearest(z: FloatArray, expected: FloatArray, period: float) -> FloatArray:
    """z (..., m) moved by whole periods to within half a one of what is expected; as it is where the period is 0."""
    if period <= 0.0:
        return z
    return np.asarray(z - period * np.round((z - expected) / period))


def fuse(
    kernel: ModuleType,
    x: FloatArray,
    form: FloatArray,
    z: FloatArray,
    H: FloatArray,
    R: FloatArray,
    thresholds: FloatArray | None,
    considered: Sequence[bool] = (),
) -> Fused:
    """Fuse one measurement.

    Parameters
    ----------
    kernel : module
        `estimfw.kernels.joseph` or `estimfw.kernels.ud`.
    x, form : (..., n), (..., n, n) array
    z, H, R : (..., m), (..., m, n), (..., m, m) array
        z may hold NaN.
    thresholds : (m + 1,) array or None
        Largest NIS that is fused, by the number of usable components; None: no gate.
    considered : (n,) sequence of bool, or empty
        States that get no gain though their covariance counts (Schmidt 1966), in each scalar; empty: none.
    """
    usable = np.isfinite(z)
    used = usable.sum(axis=-1)
    masked_z = np.where(usable, z, 0.0)
    masked_H = np.where(usable[..., None], H, 0.0)
    pair = usable[..., :, None] & usable[..., None, :]
    masked_R = np.where(pair, R, np.where(np.eye(z.shape[-1], dtype=bool), 1.0, 0.0))
    nu = masked_z - np.einsum("...ij,...j->...i", masked_H, x)
    variance = np.einsum("...ii->...i", kernel.projected(form, masked_H) + masked_R)
    new_x, new_form, nis, log_det, singular = _in_sequence(
        kernel, x, form, masked_z, masked_H, masked_R, variance, considered
    )
    disposition = np.where(used == 0, MISSING, np.where(singular, INVALID, FUSED))
    if thresholds is not None:
        disposition = np.where((disposition == FUSED) & (nis > thresholds[used]), GATED, disposition)
    fused = disposition == FUSED
    return Fused(
        np.where(fused[..., None], new_x, x),
        np.where(fused[..., None, None], new_form, form),
        np.where(usable, nu, np.nan),
        np.where(usable, np.sqrt(np.abs(variance)), np.nan),
        np.where(used == 0, np.nan, nis),
        disposition,
        np.where(fused, used, 0),
        np.where(fused | (disposition == GATED), log_det, np.nan),
    )


def _in_sequence(
    kernel: ModuleType,
    x: FloatArray,
    form: FloatArray,
    z: FloatArray,
    H: FloatArray,
    R: FloatArray,
    variance: FloatArray,
    considered: Sequence[bool],
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, NDArray[np.bool_]]:
    """The scalars one after the other: new state, NIS, ln det S, and whether some innovation variance is not to be trusted.

    The variance of a scalar given those before it is a pivot of S, so the NIS is the sum over scalars, det S the product of
    their variances, and no S need be inverted. A variance far below that of its row may be a rounding, unless the row's own
    noise is in it.
    """
    r, rows = decorrelate(R, np.concatenate([H, z[..., None]], axis=-1))
    nis, log_det = np.zeros(x.shape[:-1]), np.zeros(x.shape[:-1])
    singular = np.zeros(x.shape[:-1], dtype=bool)
    gained = ~np.array(considered, dtype=bool)
    for i in range(z.shape[-1]):
        h = rows[..., i, :-1]
        form, K, s = kernel.update(form, h, r[..., i])
        if len(considered):  # without the gain K_c of these states P is larger by K_c s K_c'
            form, K = kernel.added(form, np.where(gained, 0.0, K), s), np.where(gained, K, 0.0)
        noisy = r[..., i] > SINGULAR * R[..., i, i]
        good = np.isfinite(s) & (s > 0.0) & (noisy | (s > SINGULAR * variance[..., i]))
        singular = singular | ~good
        t = rows[..., i, -1] - np.einsum("...i,...i->...", h, x)
        nis = nis + np.where(good, t**2 / np.where(good, s, 1.0), 0.0)
        log_det = log_det + np.log(np.where(good, s, 1.0))
        x = x + K * t[..., None]
    return x, form, nis, log_det, singular
