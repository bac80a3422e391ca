"""The recursions as loops for numba: the same algorithms as `discretise`, `joseph`, `ud` and `fuse`, in place, no leading axes.

Sparse products run over the entries of F that can be other than zero. The exact discretisation sums the Taylor series of
Phi and Q (Q' = F Q + Q F' + D) until it stands still, on an interval halved until ``|F| h < 1/2``, and doubles back: the same
integral as Van Loan's, by another road.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from estimfw.kernels.fuse import FUSED, GATED, INVALID, MISSING, SINGULAR
from estimfw.kernels.ud import PIVOT

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def evaluate(entry, constant, factors, row, out):
    """out.flat[entry] += constant * product of factors; out is flat and is cleared first."""
    out[:] = 0.0
    for k in range(entry.shape[0]):
        value = constant[k]
        for p in range(factors.shape[1]):
            if factors[k, p] >= 0:
                value *= row[factors[k, p]]
        out[entry[k]] += value


@njit(cache=True)
def sparse_times(ni, nj, values, X, out):
    """out = F X for F with values at (ni, nj)."""
    n = X.shape[1]
    out[:, :] = 0.0
    for k in range(ni.shape[0]):
        i, j, f = ni[k], nj[k], values[k]
        if f != 0.0:
            for c in range(n):
                out[i, c] += f * X[j, c]


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
def discretise(ni, nj, F, D, b, dt, exact, phi_order, q_order, doublings, Phi, Q, d, w1, w2, w3):
    """Phi, Q, d in place. F holds the values at (ni, nj); w1, w2, w3 are (n, n) work space."""
    n = Phi.shape[0]
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


@njit(cache=True)
def dense_times(A, B, out):
    """out = A B, skipping zeros of A."""
    out[:, :] = 0.0
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            a = A[i, k]
            if a != 0.0:
                for j in range(B.shape[1]):
                    out[i, j] += a * B[k, j]


@njit(cache=True)
def times_transposed(A, B, out):
    """out = A B', skipping zeros of B."""
    out[:, :] = 0.0
    for j in range(B.shape[0]):
        for k in range(B.shape[1]):
            b = B[j, k]
            if b != 0.0:
                for i in range(A.shape[0]):
                    out[i, j] += A[i, k] * b


@njit(cache=True)
def ud_factor(P, form):
    """U above and D on the diagonal of form; P is used up."""
    n = P.shape[0]
    form[:, :] = 0.0
    for j in range(n - 1, -1, -1):
        d = P[j, j]
        scale = P[j, j]
        for k in range(j + 1, n):
            scale += form[j, k] * form[j, k] * form[k, k]
        if abs(d) <= PIVOT * abs(scale):
            d = 0.0
        form[j, j] = d
        if d != 0.0:
            for i in range(j):
                form[i, j] = P[i, j] / d
            for i in range(j):
                for k in range(j):
                    P[i, k] -= d * form[i, j] * form[k, j]


@njit(cache=True)
def covariance(form, ud, P):
    """P of either form."""
    n = form.shape[0]
    if not ud:
        P[:, :] = form
        return
    for i in range(n):
        for j in range(i, n):
            s = 0.0
            for k in range(j, n):
                u_i = 1.0 if k == i else form[i, k]
                u_j = 1.0 if k == j else form[j, k]
                s += u_i * form[k, k] * u_j
            P[i, j] = s
            P[j, i] = s


@njit(cache=True)
def joseph_predict(P, Phi, Q, w1, w2):
    n = P.shape[0]
    dense_times(Phi, P, w1)
    times_transposed(w1, Phi, w2)
    for i in range(n):
        for j in range(i + 1):
            value = 0.5 * (w2[i, j] + w2[j, i] + Q[i, j] + Q[j, i])
            P[i, j] = value
            P[j, i] = value


@njit(cache=True)
def ud_predict(form, Phi, Q, w1, w2, W, weight):
    """Thornton; W is (n, 2n) and weight (2n,) work space. Columns without weight are left out."""
    n = form.shape[0]
    for i in range(n):
        for j in range(n):
            w1[i, j] = Q[i, j]
    ud_factor(w1, w2)
    columns = 0
    for j in range(n):
        weight[columns] = form[j, j]
        for i in range(n):
            s = Phi[i, j]
            for k in range(j):
                s += Phi[i, k] * form[k, j]
            W[i, columns] = s
        columns += 1
    for j in range(n):
        if w2[j, j] != 0.0:
            weight[columns] = w2[j, j]
            for i in range(n):
                W[i, columns] = w2[i, j] if i < j else (1.0 if i == j else 0.0)
            columns += 1
    for j in range(n - 1, -1, -1):
        d = 0.0
        for k in range(columns):
            d += W[j, k] * weight[k] * W[j, k]
        live = d > 0.0
        form[j, j] = d if live else 0.0
        for i in range(j):
            u = 0.0
            if live:
                for k in range(columns):
                    u += W[i, k] * weight[k] * W[j, k]
                u /= d
                if u != 0.0:
                    for k in range(columns):
                        W[i, k] -= u * W[j, k]
            form[i, j] = u


@njit(cache=True)
def joseph_update(P, h, r, K, w1):
    """One scalar; returns the innovation variance, K in place."""
    n = P.shape[0]
    s = r
    for i in range(n):
        t = 0.0
        for j in range(n):
            t += P[i, j] * h[j]
        w1[0, i] = t
        s += h[i] * t
    if not s > 0.0:
        K[:] = 0.0
        return s
    for i in range(n):
        K[i] = w1[0, i] / s
    for i in range(n):
        t = 0.0
        for j in range(n):
            P[i, j] -= K[i] * w1[0, j]
            t += P[i, j] * h[j]
        w1[1, i] = t
    for i in range(n):
        for j in range(n):
            P[i, j] += -w1[1, i] * K[j] + r * K[i] * K[j]
    for i in range(n):
        for j in range(i):
            P[i, j] = P[j, i] = 0.5 * (P[i, j] + P[j, i])
    return s


@njit(cache=True)
def ud_update(form, h, r, K, w1):
    """One scalar by Bierman; returns the innovation variance, K in place."""
    n = form.shape[0]
    for j in range(n):
        f = h[j]
        for i in range(j):
            f += form[i, j] * h[i]
        w1[0, j] = f
        w1[1, j] = form[j, j] * f
    alpha = r
    for j in range(n):
        before = alpha
        f, v = w1[0, j], w1[1, j]
        alpha = before + f * v
        if alpha > 0.0:
            form[j, j] = form[j, j] * before / alpha
        pull = -f / before if before > 0.0 else 0.0
        for i in range(j):
            u = form[i, j]
            form[i, j] = u + K[i] * pull
            K[i] += u * v
        K[j] = v
    for j in range(n):
        K[j] = K[j] / alpha if alpha > 0.0 else 0.0
    return alpha


@njit(cache=True)
def innovation_variance(form, ud, h, r):
    """h P h' + r of one row."""
    n = form.shape[0]
    s = r
    for j in range(n):
        if ud:
            f = h[j]
            for i in range(j):
                f += form[i, j] * h[i]
            s += f * form[j, j] * f
        elif h[j] != 0.0:
            for i in range(n):
                s += h[j] * form[j, i] * h[i]
    return s


@njit(cache=True)
def decorrelate(A, rows, m):
    """A = L diag(r) L' over the first m; r is left on A's diagonal, rows (m, k) become L^-1 rows."""
    for j in range(m):
        if A[j, j] > 0.0:
            for i in range(j + 1, m):
                ell = A[i, j] / A[j, j]
                if ell != 0.0:
                    for c in range(j + 1, m):
                        A[i, c] -= ell * A[j, c]
                    for c in range(rows.shape[1]):
                        rows[i, c] -= ell * rows[j, c]


@njit(cache=True)
def fuse(x, form, ud, z, H, R, thresholds, gated, innovation, sigma, A, rows, usable, x_before, before, K, w1):
    """One vector measurement in place; returns NIS, disposition and the number of fused components.

    ``A`` (m, m) and ``rows`` (m, n + 1) hold at least one measurement; ``x_before`` (n,) and ``before`` (n, n) are for what a
    refused one must leave as it was.
    """
    n, m = x.shape[0], z.shape[0]
    used = 0
    for a in range(m):
        usable[a] = np.isfinite(z[a])
        innovation[a] = np.nan
        sigma[a] = np.nan
        if usable[a]:
            used += 1
            t = z[a]
            for i in range(n):
                t -= H[a, i] * x[i]
            innovation[a] = t
            sigma[a] = np.sqrt(abs(innovation_variance(form, ud, H[a], R[a, a])))
    if used == 0:
        return np.nan, MISSING, 0
    x_before[:] = x
    before[:, :] = form
    for a in range(m):
        for b in range(m):
            both = usable[a] and usable[b]
            A[a, b] = R[a, b] if both else (1.0 if a == b else 0.0)
        for i in range(n):
            rows[a, i] = H[a, i] if usable[a] else 0.0
        rows[a, n] = z[a] if usable[a] else 0.0
    decorrelate(A, rows, m)
    nis, singular = 0.0, False
    for a in range(m):
        if not usable[a]:
            continue
        h, r = rows[a, :n], A[a, a]
        t = rows[a, n]
        for i in range(n):
            t -= h[i] * x[i]
        s = ud_update(form, h, r, K, w1) if ud else joseph_update(form, h, r, K, w1)
        noisy = r > SINGULAR * R[a, a]
        if not (np.isfinite(s) and s > 0.0 and (noisy or s > SINGULAR * sigma[a] * sigma[a])):
            singular = True
            continue
        nis += t * t / s
        for i in range(n):
            x[i] += K[i] * t
    if singular or (gated and nis > thresholds[used]):
        x[:] = x_before
        form[:, :] = before
        return nis, INVALID if singular else GATED, 0
    return nis, FUSED, used
