"""The steps of a smoother as loops for numba: the same as `estimfw.kernels.smooth`, over K links, no further leading axes.

Matrices are worked on transposed (``_t``), so that the innermost loops run along a row, each element with a sum of its own: they
are done several at a time, with the same roundings wherever they run.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from estimfw.kernels.compiled_recursions import ud_factor
from estimfw.kernels.smooth import KNOWN

__all__ = ["backward", "composed", "gain"]

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def gain(form, Phi, Q):
    """C and L (K, n, n) of K time updates."""
    steps, n = Phi.shape[0], Phi.shape[1]
    C, L = np.empty((steps, n, n)), np.empty((steps, n, n))
    W_t, B_t, weight, sums = np.empty((2 * n, n)), np.empty((2 * n, n)), np.empty(2 * n), np.empty(n)
    U_t, G_t, C_t, A_t = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    Uq, after, work = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    for k in range(steps):
        _times_factor(Phi[k], form[k], W_t, weight, A_t)
        work[:, :] = Q[k]
        ud_factor(work, Uq)
        columns = _with_factor(Uq, W_t, weight, n)
        _orthogonal(W_t, weight, columns, KNOWN, after, sums)
        for m in range(n):
            for i in range(n):
                U_t[m, i] = form[k, i, m] if i < m else (1.0 if i == m else 0.0)
        _scaled_gain(U_t, weight, W_t, after, G_t)
        _remainder(U_t, G_t, W_t, columns, B_t)
        for j in range(n):
            C_t[j] = G_t[j]
            for m in range(j):
                a = after[m, j]
                for i in range(n):
                    C_t[j, i] -= a * C_t[m, i]
        for i in range(n):
            for j in range(n):
                C[k, i, j] = C_t[j, i]
        _orthogonal(B_t, weight, columns, KNOWN, L[k], sums)
    return C, L


@njit(cache=True)
def _scaled_gain(U_t, D, V_t, after, G_t):
    """G = U D V1' (D-)^-1, with no column for what was known."""
    n = G_t.shape[0]
    G_t[:, :] = 0.0
    for j in range(n):
        if after[j, j] == 0.0:
            continue
        for m in range(n):
            g = D[m] * V_t[m, j] / after[j, j]
            for i in range(m + 1):
                G_t[j, i] += g * U_t[m, i]


@njit(cache=True)
def _remainder(U_t, G_t, V_t, columns, B_t):
    """B = [U - G V1, -G V2]."""
    n = G_t.shape[0]
    for c in range(columns):
        for i in range(n):
            B_t[c, i] = U_t[c, i] if c < n else 0.0
        for j in range(n):
            v = V_t[c, j]
            for i in range(n):
                B_t[c, i] -= v * G_t[j, i]


@njit(cache=True)
def backward(C, b, L, u, form):
    """Corrections (K + 1, n) and covariances (K + 1, n, n) at all ends of K links, from those at the last."""
    steps, n = b.shape
    corrections, forms = np.empty((steps + 1, n)), np.empty((steps + 1, n, n))
    corrections[steps], forms[steps] = u, form
    W_t, weight, A_t, sums = np.empty((2 * n, n)), np.empty(2 * n), np.empty((n, n)), np.empty(n)
    for k in range(steps - 1, -1, -1):
        for i in range(n):
            s = b[k, i]
            for j in range(n):
                s += C[k, i, j] * corrections[k + 1, j]
            corrections[k, i] = s
        _carried(C[k], forms[k + 1], L[k], W_t, weight, A_t, sums, forms[k])
    return corrections, forms


@njit(cache=True)
def composed(first, then):
    """One link in place of two: ``first`` is that of the earlier time."""
    (C1, b1, L1), (C2, b2, L2) = first, then
    n = b1.shape[0]
    C, b, L = np.zeros((n, n)), b1.copy(), np.empty((n, n))
    for i in range(n):
        for j in range(n):
            c = C1[i, j]
            b[i] += c * b2[j]
            for m in range(n):
                C[i, m] += c * C2[j, m]
    _carried(C1, L2, L1, np.empty((2 * n, n)), np.empty(2 * n), np.empty((n, n)), np.empty(n), L)
    return C, b, L


@njit(cache=True)
def _carried(C, form, L, W_t, weight, A_t, sums, out):
    """C P C' + L."""
    _times_factor(C, form, W_t, weight, A_t)
    columns = _with_factor(L, W_t, weight, C.shape[0])
    _orthogonal(W_t, weight, columns, 0.0, out, sums)


@njit(cache=True)
def _times_factor(A, form, W_t, weight, A_t):
    """A U in the first columns of W, D in the first weights; A_t is work space."""
    n = A.shape[0]
    for i in range(n):
        for j in range(n):
            A_t[j, i] = A[i, j]
    for j in range(n):
        weight[j] = form[j, j]
        W_t[j] = A_t[j]
        for m in range(j):
            u = form[m, j]
            for i in range(n):
                W_t[j, i] += u * A_t[m, i]


@njit(cache=True)
def _with_factor(form, W_t, weight, at):
    """The columns of U that have a D behind the first ``at`` of W; returns how many there are then."""
    n = form.shape[0]
    for j in range(n):
        if form[j, j] != 0.0:
            weight[at] = form[j, j]
            for i in range(n):
                W_t[at, i] = form[i, j] if i < j else (1.0 if i == j else 0.0)
            at += 1
    return at


@njit(cache=True)
def _orthogonal(W_t, weight, columns, least, form, sums):
    """`estimfw.kernels.ud.orthogonal` over the first columns, in place: W becomes V."""
    n = form.shape[0]
    form[:, :] = 0.0
    for c in range(columns):
        for j in range(n):
            form[j, j] += least * weight[c] * W_t[c, j] * W_t[c, j]
    for j in range(n - 1, -1, -1):
        d = 0.0
        for c in range(columns):
            d += W_t[c, j] * weight[c] * W_t[c, j]
        if not d > form[j, j]:
            form[j, j] = 0.0
            continue
        form[j, j] = d
        sums[:j] = 0.0
        for c in range(columns):
            w = weight[c] * W_t[c, j]
            for i in range(j):
                sums[i] += w * W_t[c, i]
        for i in range(j):
            sums[i] /= d
            form[i, j] = sums[i]
        for c in range(columns):
            v = W_t[c, j]
            for i in range(j):
                W_t[c, i] -= sums[i] * v
