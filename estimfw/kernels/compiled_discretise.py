"""Phi, Q and d as loops for numba: the same as `estimfw.kernels.discretise`, in place, no leading axes.

The exact discretisations sum the Taylor series of Phi and Q (Q' = F Q + Q F' + D) until it stands still, on an interval
halved until ``|F| h < 1/2``, and doubles back: the same integral as Van Loan's, by another road.
"""

from __future__ import annotations

from numba import njit

from estimfw.kernels.compiled_products import dense_times, sparse_times, times_transposed

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


SERIES, VAN_LOAN, HELD_NOISE = range(3)


@njit(cache=True)
def discretise(ni, nj, F, D, b, dt, method, phi_order, q_order, doublings, Phi, Q, d, w1, w2, w3):
    """Phi, Q, d in place. F holds the values at (ni, nj); w1, w2, w3 are (n, n) work space."""
    n = Phi.shape[0]
    exact = method != SERIES
    if exact:
        norm = 0.0
        w1[0, :] = 0.0
        for k in range(ni.shape[0]):
            w1[0, ni[k]] += abs(F[k])
        for i in range(n):
            norm = max(norm, w1[0, i])
        doublings = 0
        while norm * dt / 2.0**doublings > 0.5 and doublings < 60:
            doublings += 1
        phi_order, q_order = 40, 40
    h = dt / 2.0**doublings
    # Phi and d
    Phi[:, :] = 0.0
    w1[:, :] = 0.0
    for i in range(n):
        Phi[i, i] = 1.0
        w1[i, i] = 1.0
    forced = False
    for i in range(n):
        d[i] = b[i] * h
        forced = forced or b[i] != 0.0
    for k in range(1, phi_order + 1):
        if forced and k > 1:
            for i in range(n):
                d_term = 0.0
                for j in range(n):
                    d_term += w1[i, j] * b[j]
                d[i] += d_term * h / k
        sparse_times(ni, nj, F, w1, w2)
        for i in range(n):
            for j in range(n):
                w1[i, j] = w2[i, j] * (h / k)
        if not _grow(Phi, w1) and exact:
            break
    if method == HELD_NOISE:
        _hold(ni, nj, F, D, dt, h, phi_order, doublings, Phi, Q, d, w1, w2, w3)
        return
    # Q
    for i in range(n):
        for j in range(n):
            w1[i, j] = D[i * n + j] * h
            Q[i, j] = w1[i, j]
    for k in range(2, q_order + 1):
        sparse_times(ni, nj, F, w1, w2)
        for i in range(n):
            for j in range(n):
                w3[i, j] = (w2[i, j] + w2[j, i]) * (h / k)
        for i in range(n):
            for j in range(n):
                w1[i, j] = w3[i, j]
        if not _grow(Q, w1) and exact:
            break
    for _ in range(doublings):
        _double(Phi, Q, d, w1, w2, w3)
    for i in range(n):
        for j in range(i):
            Q[i, j] = Q[j, i] = 0.5 * (Q[i, j] + Q[j, i])


@njit(cache=True)
def _hold(ni, nj, F, D, dt, h, order, doublings, Phi, Q, d, w1, w2, w3):
    """Phi and d over the whole step from those over h, and Q = Gamma (D / dt) Gamma'; Gamma stands in w3 meanwhile."""
    n = Phi.shape[0]
    w1[:, :] = 0.0
    for i in range(n):
        w1[i, i] = h
    w3[:, :] = w1
    for k in range(2, order + 1):
        sparse_times(ni, nj, F, w1, w2)
        for i in range(n):
            for j in range(n):
                w1[i, j] = w2[i, j] * (h / k)
        if not _grow(w3, w1):
            break
    for _ in range(doublings):
        for i in range(n):
            w1[0, i] = d[i]
            for j in range(n):
                w1[0, i] += Phi[i, j] * d[j]
        d[:] = w1[0]
        dense_times(Phi, w3, w1)
        for i in range(n):
            for j in range(n):
                w3[i, j] += w1[i, j]
        dense_times(Phi, Phi, w1)
        Phi[:, :] = w1
    for i in range(n):
        for j in range(n):
            w1[i, j] = D[i * n + j] / dt
    dense_times(w3, w1, w2)
    times_transposed(w2, w3, Q)
    for i in range(n):
        for j in range(i):
            Q[i, j] = Q[j, i] = 0.5 * (Q[i, j] + Q[j, i])


@njit(cache=True)
def _grow(total, term):
    """total += term; whether anything moved."""
    moved = False
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            t = term[i, j]
            if abs(t) > 1e-17 * abs(total[i, j]):
                moved = True
            total[i, j] += t
    return moved


@njit(cache=True)
def _double(Phi, Q, d, w1, w2, w3):
    n = Phi.shape[0]
    for i in range(n):
        s = d[i]
        for j in range(n):
            s += Phi[i, j] * d[j]
        w3[0, i] = s
    for i in range(n):
        d[i] = w3[0, i]
    dense_times(Phi, Q, w1)
    times_transposed(w1, Phi, w2)
    for i in range(n):
        for j in range(n):
            Q[i, j] += w2[i, j]
    dense_times(Phi, Phi, w1)
    for i in range(n):
        for j in range(n):
            Phi[i, j] = w1[i, j]
