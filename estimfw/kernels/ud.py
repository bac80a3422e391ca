"""P = U D U', U unit upper triangular, D diagonal (Bierman 1977): P stays positive whatever the numbers do.

The form that the recursion carries is one array (..., n, n): D on the diagonal, U above it. Time update by Thornton's
modified weighted Gram-Schmidt, measurement update by Bierman's recursion, one scalar at a time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["covariance", "factor", "predict", "projected", "update"]

FloatArray = NDArray[np.float64]

#: A pivot below this part of its diagonal element is rounding, and counts as zero.
PIVOT = 1e-14


def factor(P: FloatArray) -> FloatArray:
    """U and D of a positive semidefinite P (..., n, n); a pivot lost in rounding is zero.

    A pivot that is clearly negative stays so, and shows in D: P is not positive semidefinite then.
    """
    A = np.array(P, dtype=float)
    form = np.zeros_like(A)
    for j in range(A.shape[-1] - 1, -1, -1):
        d = A[..., j, j]
        d = np.where(np.abs(d) <= PIVOT * np.abs(P[..., j, j]), 0.0, d)
        live = d != 0.0
        u = np.where(live[..., None], A[..., :j, j] / np.where(live, d, 1.0)[..., None], 0.0)
        form[..., j, j] = d
        form[..., :j, j] = u
        A[..., :j, :j] -= d[..., None, None] * u[..., :, None] * u[..., None, :]
    return form


def _split(form: FloatArray) -> tuple[FloatArray, FloatArray]:
    n = form.shape[-1]
    D = np.einsum("...ii->...i", form).copy()
    return np.triu(form, 1) + np.eye(n), D


def covariance(form: FloatArray) -> FloatArray:
    """U D U', (..., n, n)."""
    U, D = _split(form)
    return (U * D[..., None, :]) @ np.swapaxes(U, -1, -2)


def predict(form: FloatArray, Phi: FloatArray, Q: FloatArray) -> FloatArray:
    """Thornton: U D U' <- Phi U D U' Phi' + Q, without forming P."""
    U, D = _split(form)
    Uq, Dq = _split(factor(Q))
    W = np.concatenate(np.broadcast_arrays(Phi @ U, Uq), axis=-1)
    weight = np.concatenate(np.broadcast_arrays(D, Dq), axis=-1)
    new = np.zeros_like(W[..., : form.shape[-1]])
    for j in range(form.shape[-1] - 1, -1, -1):
        c = weight * W[..., j, :]
        d = np.einsum("...k,...k->...", W[..., j, :], c)
        live = d > 0.0
        u = np.einsum("...ik,...k->...i", W[..., :j, :], c)
        u = np.where(live[..., None], u / np.where(live, d, 1.0)[..., None], 0.0)
        new[..., j, j] = np.where(live, d, 0.0)
        new[..., :j, j] = u
        W[..., :j, :] -= u[..., :, None] * W[..., None, j, :]
    return new


def projected(form: FloatArray, H: FloatArray) -> FloatArray:
    """H P H', (..., m, m)."""
    U, D = _split(form)
    f = H @ U
    return (f * D[..., None, :]) @ np.swapaxes(f, -1, -2)


def update(form: FloatArray, h: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One scalar measurement by Bierman's recursion; arguments and results as `estimfw.kernels.joseph.update`."""
    U, D = _split(form)
    f = np.einsum("...ij,...i->...j", U, h)
    v = D * f
    lead = np.broadcast_shapes(f.shape[:-1], np.shape(r))
    alpha = np.broadcast_to(np.asarray(r, dtype=float), lead).copy()
    b = np.zeros((*lead, form.shape[-1]))
    new = np.broadcast_to(form, (*lead, *form.shape[-2:])).copy()
    for j in range(form.shape[-1]):
        before = alpha
        alpha = before + f[..., j] * v[..., j]
        live = alpha > 0.0
        new[..., j, j] = np.where(live, D[..., j] * before / np.where(live, alpha, 1.0), D[..., j])
        pull = np.where(before > 0.0, -f[..., j] / np.where(before > 0.0, before, 1.0), 0.0)
        u = U[..., :j, j]
        new[..., :j, j] = u + b[..., :j] * pull[..., None]
        b[..., :j] += u * v[..., j, None]
        b[..., j] = v[..., j]
    usable = alpha > 0.0
    gain = np.where(usable[..., None], b / np.where(usable, alpha, 1.0)[..., None], 0.0)
    return new, gain, alpha
