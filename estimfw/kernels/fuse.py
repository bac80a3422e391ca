"""One vector measurement: innovation, NIS, gate, and the scalars in sequence.

A component that is not usable (NaN) is masked: its row of H, its z and its correlations are zero, its variance one, so it
changes nothing; the rest is fused. A full R is decorrelated by R = L diag(r) L'.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

__all__ = ["FUSED", "GATED", "INVALID", "LATE", "MEANINGS", "MISSING", "Fused", "decorrelate", "fuse"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FUSED, GATED, LATE, MISSING, INVALID = range(5)
MEANINGS = ("fused", "gated", "late", "missing", "invalid")

#: An innovation covariance whose unit-diagonal determinant pivots fall below this is singular.
SINGULAR = 1e-13


@dataclass(frozen=True, slots=True)
class Fused:
    """What became of a measurement: new state, innovation (NaN where masked), its sigma, NIS, disposition, components."""

    x: FloatArray
    form: FloatArray
    innovation: FloatArray
    sigma: FloatArray
    nis: FloatArray
    disposition: IntArray
    used: IntArray


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


def fuse(
    kernel: ModuleType,
    x: FloatArray,
    form: FloatArray,
    z: FloatArray,
    H: FloatArray,
    R: FloatArray,
    thresholds: FloatArray | None,
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
    """
    m = z.shape[-1]
    usable = np.isfinite(z)
    used = usable.sum(axis=-1)
    masked_z = np.where(usable, z, 0.0)
    masked_H = np.where(usable[..., None], H, 0.0)
    pair = usable[..., :, None] & usable[..., None, :]
    masked_R = np.where(pair, R, np.where(np.eye(m, dtype=bool), 1.0, 0.0))
    nu = masked_z - np.einsum("...ij,...j->...i", masked_H, x)
    S = kernel.projected(form, masked_H) + masked_R
    pivots, white = decorrelate(S, nu[..., None])
    scale = np.einsum("...ii->...i", S)
    singular = np.any(pivots <= SINGULAR * scale, axis=-1) | ~np.all(np.isfinite(pivots), axis=-1)
    nis = np.sum(np.where(usable, white[..., 0] ** 2 / np.where(pivots > 0.0, pivots, np.inf), 0.0), axis=-1)
    disposition = np.where(used == 0, MISSING, np.where(singular, INVALID, FUSED))
    if thresholds is not None:
        disposition = np.where((disposition == FUSED) & (nis > thresholds[used]), GATED, disposition)
    fused = disposition == FUSED
    r, rows = decorrelate(masked_R, np.concatenate([masked_H, masked_z[..., None]], axis=-1))
    for i in range(m):
        open_ = usable[..., i] & fused
        h = np.where(open_[..., None], rows[..., i, :-1], 0.0)
        form, K, _ = kernel.update(form, h, np.where(open_, r[..., i], 1.0))
        x = x + K * (rows[..., i, -1] - np.einsum("...i,...i->...", rows[..., i, :-1], x))[..., None]
    return Fused(
        x,
        form,
        np.where(usable, nu, np.nan),
        np.where(usable, np.sqrt(np.abs(scale)), np.nan),
        np.where(used == 0, np.nan, nis),
        disposition,
        np.where(fused, used, 0),
    )
