"""The covariance as loops for numba: the same as `estimfw.kernels.ud` and `joseph`, in place, no leading axes."""

from __future__ import annotations

from numba import njit

from estimfw.kernels.compiled_products import dense_times, times_transposed
from estimfw.kernels.ud import PIVOT

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


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
def joseph_added(P, v, c):
    """P + c v v'."""
    n = P.shape[0]
    for i in range(n):
        for j in range(n):
            P[i, j] += c * v[i] * v[j]


@njit(cache=True)
def ud_added(form, v, c):
    """U D U' + c v v' by Agee and Turner; v is used up."""
    n = form.shape[0]
    for j in range(n - 1, -1, -1):
        before, a = form[j, j], v[j]
        d = before + c * a * a
        form[j, j] = d
        pull = c * a / d if d > 0.0 else 0.0
        for i in range(j):
            v[i] -= a * form[i, j]
            form[i, j] += pull * v[i]
        if d > 0.0:
            c = c * before / d
