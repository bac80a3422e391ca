"""The two halves of a step as loops for numba: the prediction over its interval, and the measurements due at its end."""

from __future__ import annotations

import numpy as np
from numba import njit

from estimfw.kernels.compiled_discretise import discretise
from estimfw.kernels.compiled_fuse import fuse, nearest
from estimfw.kernels.compiled_products import evaluate
from estimfw.kernels.compiled_recursions import joseph_predict, ud_predict

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def prediction_space(n, inputs, entries):
    """What `predict` works in: flat F, D, B; values of F at its entries, known rate; Phi, Q, d; rows of work space."""
    return (
        np.zeros(n * n), np.zeros(n * n), np.zeros(max(1, n * inputs)), np.zeros(entries), np.zeros(n),
        np.zeros((n, n)), np.zeros((n, n)), np.zeros(n),
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, 2 * n)), np.zeros(2 * n), np.zeros(n),
    )  # fmt: skip


@njit(cache=True)
def fusion_space(n, rows, most):
    """What `fuse_due` works in: flat H, the nominal's part of z; what `fuse` asks for, for ``most`` rows at a time."""
    return (
        np.zeros(max(1, rows * n)), np.zeros(max(1, rows)),
        np.zeros((most, most)), np.zeros((most, n + 1)), np.zeros(most, dtype=np.bool_),
        np.zeros(n), np.zeros((n, n)), np.zeros(n), np.zeros((2, n)),
    )  # fmt: skip


@njit(cache=True)
def predict(x, form, ud, row, known, dt, doublings, stale, process, method, space):
    """Over an interval of dt (s), in place; Phi, Q and d are those of the step before where they are not ``stale``.

    ``row`` is the nominal, ``known`` the inputs. ``process``: (entry, constant, factors) of F, D and B, and positions of F.
    """
    Fe, Fc, Ff, De, Dc, Df, Be, Bc, Bf, ni, nj = process
    formula, phi_order, q_order = method
    F, D, B, values, b, Phi, Q, d, w1, w2, w3, W, weight, y = space
    n = x.shape[0]
    if stale:
        evaluate(Fe, Fc, Ff, row, F)
        evaluate(De, Dc, Df, row, D)
        for p in range(ni.shape[0]):
            values[p] = F[ni[p] * n + nj[p]]
        b[:] = 0.0
        inputs = known.shape[0]
        if inputs:
            evaluate(Be, Bc, Bf, row, B)
            for i in range(n):
                for c in range(inputs):
                    b[i] += B[i * inputs + c] * known[c]
        discretise(ni, nj, values, D, b, dt, formula, phi_order, q_order, doublings, Phi, Q, d, w1, w2, w3)
    for i in range(n):
        t = d[i]
        for j in range(n):
            t += Phi[i, j] * x[j]
        y[i] = t
    x[:] = y
    if ud:
        ud_predict(form, Phi, Q, w1, w2, W, weight)
    else:
        joseph_predict(form, Phi, Q, w1, w2)


@njit(cache=True)
def fuse_due(x, form, ud, row, readings, due, interval, reads, measurements, found, space):
    """All that is due at the end of a step, in place; returns whether anything was fused.

    ``reads``: (entry, constant, factors) of H and of the nominal's part of z, all rows stacked. ``found``: innovation, sigma,
    NIS, disposition, number of fused components and ln det S.
    """
    He, Hc, Hf, Ie, Ic, If = reads
    offsets, R_all, density, sign, thresholds, gated, period, considered = measurements
    innovation, sigma, nis, disposition, used, log_det = found
    H_flat, nominal, A, rows, usable, x_before, before, K, w1 = space
    total, n = offsets[-1], x.shape[0]
    any_fused = False
    if total:
        evaluate(He, Hc, Hf, row, H_flat)
        evaluate(Ie, Ic, If, row, nominal)
    H = H_flat[: total * n].reshape(total, n)
    for m in range(offsets.shape[0] - 1):
        if not due[m]:
            continue
        lo, hi = offsets[m], offsets[m + 1]
        z = nominal[lo:hi] + sign[m] * readings[lo:hi]
        if period[m] > 0.0:
            nearest(z, H[lo:hi], x, period[m])
        R = R_all[lo:hi, : hi - lo] / (interval[m] if density[m] else 1.0)
        nis[m], disposition[m], used[m], log_det[m] = fuse(
            x, form, ud, considered, z, H[lo:hi], R, thresholds[m], gated[m],
            innovation[lo:hi], sigma[lo:hi], A, rows, usable, x_before, before, K, w1,
        )  # fmt: skip
        any_fused = any_fused or used[m] > 0
    return any_fused
