"""A whole chunk of steps in one compiled loop: provider, coefficients, prediction, updates, correction.

The line marked *provider* is replaced when code for another provider is generated (`estimfw.kernels.generated`); as it
stands this module is the scan of a model without one.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from estimfw.kernels.compiled import covariance, discretise, evaluate, fuse, joseph_predict, ud_predict
from estimfw.kernels.no_provider import correct, step  # provider

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def scan(
    x, form, provider, params, row, chunk, tables, measurements, method, options, prior, slots, out
):  # fmt: skip
    """Run the steps of a chunk in place; returns the index of the first step that went wrong, -1 if none.

    ``chunk``: samples, dt, restart, inputs, readings, due, interval. ``tables``: (entry, constant, factors) of F, D, B, H (all
    rows stacked) and innovation, and the positions (ni, nj) of F. ``measurements``: offsets, R (rows, most rows), density,
    sign, thresholds, gated. ``method``: exact, orders of Phi and Q, doublings a step. ``options``: ud, closed loop, steady.
    """
    samples, dts, restart, inputs, readings, due, interval = chunk
    Fe, Fc, Ff, De, Dc, Df, Be, Bc, Bf, He, Hc, Hf, Ie, Ic, If, ni, nj = tables
    offsets, R_all, density, sign, thresholds, gated = measurements
    exact, phi_order, q_order, doublings = method
    ud, closed, steady = options
    x0, form0 = prior
    estimates, covariances, rows_out, innovations, sigmas, nises, dispositions, useds = out
    n, total = x.shape[0], offsets[-1]
    most = max(1, R_all.shape[1])
    width = slots.max() + 1 if n else 0
    width = 3 * ((width + 2) // 3)
    provided = rows_out.shape[1]
    process_row, end_row = row.copy(), row.copy()
    F, D, B = np.zeros(n * n), np.zeros(n * n), np.zeros(max(1, n * inputs.shape[1]))
    values = np.zeros(ni.shape[0])
    H_flat, inn = np.zeros(max(1, total * n)), np.zeros(max(1, total))
    Phi, Q, d, b = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    size = max(n, most, 2)
    w1, w2, w3 = np.zeros((size, n)), np.zeros((size, n)), np.zeros((size, n))
    W, weight, K, y = np.zeros((n, 2 * n)), np.zeros(2 * n), np.zeros(n), np.zeros(n)
    A, rows, usable = np.zeros((most, most)), np.zeros((most, n + 1)), np.zeros(most, dtype=np.bool_)
    x_before, before = np.zeros(n), np.zeros((n, n))
    delta = np.zeros(max(1, width))
    last_dt = -1.0
    for k in range(dts.shape[0]):
        if restart[k]:
            if width:
                _scatter(x, slots, delta)
                correct(provider, delta, params)
            x[:] = x0
            form[:, :] = form0
        step(provider, samples[k], params, process_row, end_row)
        dt = dts[k]
        if dt > 0.0:
            if not steady or dt != last_dt:
                evaluate(Fe, Fc, Ff, process_row, F)
                evaluate(De, Dc, Df, process_row, D)
                for p in range(ni.shape[0]):
                    values[p] = F[ni[p] * n + nj[p]]
                b[:] = 0.0
                if inputs.shape[1]:
                    evaluate(Be, Bc, Bf, process_row, B)
                    for i in range(n):
                        for c in range(inputs.shape[1]):
                            b[i] += B[i * inputs.shape[1] + c] * inputs[k, c]
                discretise(
                    ni, nj, values, D, b, dt, exact, phi_order, q_order, doublings[k], Phi, Q, d, w1[:n], w2[:n], w3[:n]
                )
                last_dt = dt
            for i in range(n):
                t = d[i]
                for j in range(n):
                    t += Phi[i, j] * x[j]
                y[i] = t
            x[:] = y
            if ud:
                ud_predict(form, Phi, Q, w1[:n], w2[:n], W, weight)
            else:
                joseph_predict(form, Phi, Q, w1[:n], w2[:n])
        any_fused = False
        if total:
            evaluate(He, Hc, Hf, end_row, H_flat)
            evaluate(Ie, Ic, If, end_row, inn)
        H = H_flat[: total * n].reshape(total, n)
        for m in range(offsets.shape[0] - 1):
            if not due[k, m]:
                continue
            lo, hi = offsets[m], offsets[m + 1]
            z = inn[lo:hi] + sign[m] * readings[k, lo:hi]
            R = R_all[lo:hi, : hi - lo] / (interval[k, m] if density[m] else 1.0)
            nis, disposition, used = fuse(
                x, form, ud, z, H[lo:hi], R, thresholds[m], gated[m],
                innovations[k, lo:hi], sigmas[k, lo:hi], A, rows, usable, x_before, before, K, w1,
            )  # fmt: skip
            nises[k, m], dispositions[k, m], useds[k, m] = nis, disposition, used
            any_fused = any_fused or used > 0
        estimates[k] = x
        covariance(form, ud, covariances[k])
        rows_out[k] = end_row[:provided]
        for i in range(n):
            if not np.isfinite(x[i]):
                return k
        if closed and any_fused and width:
            _scatter(x, slots, delta)
            correct(provider, delta, params)
            for i in range(n):
                if slots[i] >= 0:
                    x[i] = 0.0
    return -1


@njit(cache=True)
def _scatter(x, slots, delta):
    delta[:] = 0.0
    for i in range(x.shape[0]):
        if slots[i] >= 0:
            delta[slots[i]] = x[i]
