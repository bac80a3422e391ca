"""P = U D U', U unit upper triangular, D diagonal (Bierman 1977): P stays positive whatever the numbers do.

The form that the recursion carries is one array (..., n, n): D on the diagonal, U above it. Time update by Thornton's
modified weighted Gram-Schmidt, measurement update by Bierman's recursion, one scalar at a time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["added", "covariance", "factor", "orthogonal", "predict", "projected", "split", "update"]

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


def split(form: FloatArray) -> tuple[FloatArray, FloatArray]:
    """U (..., n, n) and D (..., n)."""
    n = form.shape[-1]
    D = np.einsum("...ii->...i", form).copy()
    return np.triu(form, 1) + np.eye(n), D


def covariance(form: FloatArray) -> FloatArray:
    """U D U', (..., n, n)."""
    U, D = split(form)
    return (U * D[..., None, :]) @ np.swapaxes(U, -1, -2)


def predict(form: FloatArray, Phi: FloatArray, Q: FloatArray) -> FloatArray:
    """Thornton: U D U' <- Phi U D U' Phi' + Q, without forming P."""
    U, D = split(form)
    Uq, Dq = split(factor(Q))
    W = np.concatenate(np.broadcast_arrays(Phi @ U, Uq), axis=-1)
    weight = np.concatenate(np.broadcast_arrays(D, Dq), axis=-1)
    return orthogonal(W, weight)[0]


def orthogonal(W: FloatArray, weight: FloatArray, least: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """W = U V with V diag(weight) V' = D, by modified weighted Gram-Schmidt from the last row up.

    Parameters
    ----------
    W : (..., n, m) array
    weight : (..., m) array
    least : float
        A row of which no larger part than this of its square is left counts as a combination of those below it.

    Returns
    -------
    form : (..., n, n) array
        U and D.
    V : (..., n, m) array
        A row without a D is what rounding left of it.
    """
    V, n = W.copy(), W.shape[-2]
    size = least * np.einsum("...jk,...k->...j", W**2, weight) if least else np.zeros(W.shape[:-1])
    form = np.zeros((*W.shape[:-1], n))
    for j in range(n - 1, -1, -1):
        c = weight * V[..., j, :]
        d = np.einsum("...k,...k->...", V[..., j, :], c)
        live = d > size[..., j]
        u = np.einsum("...ik,...k->...i", V[..., :j, :], c)
        u = np.where(live[..., None], u / np.where(live, d, 1.0)[..., None], 0.0)
        form[..., j, j] = np.where(live, d, 0.0)
        form[..., :j, j] = u
        V[..., :j, :] -= u[..., :, None] * V[..., None, j, :]
    return form, V


def projected(form: FloatArray, H: FloatArray) -> FloatArray:
    """H P H', (..., m, m)."""
    U, D = split(form)
    f = H @ U
    return (f * D[..., None, :]) @ np.swapaxes(f, -1, -2)


def update(form: FloatArray, h: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One scalar measurement by Bierman's recursion; arguments and results as `estimfw.kernels.joseph.update`."""
    U, D = split(form)
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


def added(form: FloatArray, v: FloatArray, c: FloatArray) -> FloatArray:
    """U D U' + c v v' by Agee and Turner's recursion (1972), for v (..., n) and c (...) not negative."""
    lead = np.broadcast_shapes(form.shape[:-2], v.shape[:-1], np.shape(c))
    new, a = np.broadcast_to(form, (*lead, *form.shape[-2:])).copy(), np.broadcast_to(v, (*lead, v.shape[-1])).copy()
    weight = np.broadcast_to(np.maximum(np.asarray(c, dtype=float), 0.0), lead).copy()
    for j in range(form.shape[-1] - 1, -1, -1):
        before = new[..., j, j].copy()
        d = before + weight * a[..., j] ** 2
        live = d > 0.0
        pull = np.where(live, weight * a[..., j] / np.where(live, d, 1.0), 0.0)
        new[..., j, j] = d
        a[..., :j] -= a[..., j, None] * new[..., :j, j]
        new[..., :j, j] += pull[..., None] * a[..., :j]
        weight = np.where(live, weight * before / np.where(live, d, 1.0), weight)
    return new
