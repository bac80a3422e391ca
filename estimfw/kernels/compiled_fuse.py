"""One vector measurement as loops for numba: the same as `estimfw.kernels.fuse`, in place, no leading axes."""

from __future__ import annotations

import numpy as np
from numba import njit

from estimfw.kernels.compiled_recursions import joseph_added, joseph_update, ud_added, ud_update
from estimfw.kernels.fuse import FUSED, GATED, INVALID, MISSING, SINGULAR

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def fuse(
    x, form, ud, considered, z, H, R, thresholds, gated, innovation, sigma, A, rows, usable, x_before, before, K, w1
):
    """One vector measurement in place; returns NIS, disposition, number of fused components and ln det S.

    ``considered`` (n,) or (0,) are states that get no gain. ``A`` (m, m) and ``rows`` (m, n + 1) hold at least one measurement;
    ``x_before`` (n,) and ``before`` (n, n) are for what a refused one must leave as it was.
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
        return np.nan, MISSING, 0, np.nan
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
    nis, log_det, singular = 0.0, 0.0, False
    for a in range(m):
        if not usable[a]:
            continue
        h, r = rows[a, :n], A[a, a]
        t = rows[a, n]
        for i in range(n):
            t -= h[i] * x[i]
        s = ud_update(form, h, r, K, w1) if ud else joseph_update(form, h, r, K, w1)
        if considered.shape[0] and s > 0.0:
            without_gain(form, ud, considered, K, s, w1[0])
        noisy = r > SINGULAR * R[a, a]
        if not (np.isfinite(s) and s > 0.0 and (noisy or s > SINGULAR * sigma[a] * sigma[a])):
            singular = True
            continue
        nis += t * t / s
        log_det += np.log(s)
        for i in range(n):
            x[i] += K[i] * t
    if singular or (gated and nis > thresholds[used]):
        x[:] = x_before
        form[:, :] = before
        return nis, INVALID if singular else GATED, 0, np.nan if singular else log_det
    return nis, FUSED, used, log_det


@njit(cache=True)
def nearest(z, H, x, period):
    """z (m,) moved by whole periods to within half a one of H x, in place."""
    for a in range(z.shape[0]):
        away = z[a]
        for i in range(x.shape[0]):
            away -= H[a, i] * x[i]
        z[a] -= period * np.round(away / period)


@njit(cache=True)
def without_gain(form, ud, considered, K, s, v):
    """Take their gain K_c from considered states, of which P is larger by K_c s K_c'; v (n,) is work space."""
    for i in range(considered.shape[0]):
        v[i] = K[i] if considered[i] else 0.0
        if considered[i]:
            K[i] = 0.0
    if ud:
        ud_added(form, v, s)
    else:
        joseph_added(form, v, s)


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
