"""A whole chunk of steps in one compiled loop: provider, coefficients, prediction, updates, correction.

The line marked *provider* is replaced when code for another provider is generated, and so is `compiled_derived`
(`estimfw.kernels.generated`); as it stands this module is the scan of a model without provider and derived variables.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from estimfw.kernels.compiled_derived import complete_end, complete_process
from estimfw.kernels.compiled_products import evaluate
from estimfw.kernels.compiled_recursions import covariance
from estimfw.kernels.compiled_steps import fuse_due, fusion_space, predict, prediction_space
from estimfw.kernels.no_provider import correct, step  # provider

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def scan(
    x,
    form,
    provider,
    params,
    row,
    chunk,
    process,
    reads,
    measurements,
    method,
    doublings,
    options,
    prior,
    correction,
    out,
    moves,
):
    """Run the steps of a chunk in place; returns the index of the first step that went wrong, -1 if none.

    ``row``: the nominal before the chunk, and at its end; derived variables and work space stand behind what is provided.
    ``chunk``: samples, dt, restart, inputs, readings, due, interval. ``process`` and ``reads``: see `predict` and `fuse_due`.
    ``measurements``: offsets, R (rows, most rows), density, sign, thresholds, gated, period, considered states.
    ``method``: formula, orders of Phi and Q. ``options``: ud, closed loop, the places in ``row`` that Phi, Q and d depend on.
    ``correction``: (entry, constant, factors) of it, which states it takes, its rows.
    ``moves``: Phi, Q, d and form of each step for a smoother, or of no steps.
    """
    samples, dts, restart, inputs, readings, due, interval = chunk
    ud, closed, watched = options
    x0, form0 = prior
    estimates, covariances, rows_out, providers, innovations, sigmas, nises, dispositions, useds, log_dets = out
    n, offsets, R = x.shape[0], measurements[0], measurements[1]
    corrected, width = correction[3], correction[4]
    delta, C = np.zeros(width), np.zeros(width * n)
    correcting = np.any(corrected)
    provided = rows_out.shape[1]
    complete_end(row)
    process_row = row.copy()
    predicting = prediction_space(n, inputs.shape[1], process[-1].shape[0])
    fusing = fusion_space(n, offsets[-1], max(1, R.shape[1]))
    last_dt, last_row, last_inputs = -1.0, np.zeros(watched.shape[0]), np.zeros(inputs.shape[1])
    every_input = np.arange(inputs.shape[1])
    stepping, driven = watched.shape[0] > 0, inputs.shape[1] > 0
    transitions, noises, drifts, forms = moves
    moving = forms.shape[0] > 0
    for k in range(dts.shape[0]):
        if restart[k]:
            if correcting:
                _estimate(x, correction, row, C, delta)
                correct(provider, delta, params)
            x[:] = x0
            form[:, :] = form0
        step(provider, samples[k], params, process_row[:provided], row[:provided])
        complete_end(row)
        dt = dts[k]
        if dt > 0.0:
            stale = dt != last_dt
            if stepping and _moved(process_row, watched, last_row):
                stale = True
            if driven and _moved(inputs[k], every_input, last_inputs):
                stale = True
            if stale:
                complete_process(process_row)
            predict(x, form, ud, process_row, inputs[k], dt, doublings[k], stale, process, method, predicting)
            last_dt = dt
            if moving:
                transitions[k], noises[k], drifts[k] = predicting[5], predicting[6], predicting[7]
        found = (innovations[k], sigmas[k], nises[k], dispositions[k], useds[k], log_dets[k])
        any_fused = fuse_due(
            x, form, ud, row, readings[k], due[k], interval[k], reads, measurements, found, fusing
        )  # fmt: skip
        estimates[k] = x
        covariance(form, ud, covariances[k])
        if moving:
            forms[k] = form
        rows_out[k] = row[:provided]
        providers[k] = provider
        if not np.all(np.isfinite(x)):
            return k
        if closed and any_fused and correcting:
            _estimate(x, correction, row, C, delta)
            correct(provider, delta, params)
            for i in range(n):
                if corrected[i]:
                    x[i] = 0.0
    return -1


@njit(cache=True)
def _estimate(x, correction, row, C, delta):
    """What the provider is corrected by, in the frames of its slots; C is flat work space."""
    n = x.shape[0]
    evaluate(correction[0], correction[1], correction[2], row, C)
    for i in range(delta.shape[0]):
        delta[i] = 0.0
        for j in range(n):
            delta[i] += C[i * n + j] * x[j]


@njit(cache=True)
def _moved(values, places, last):
    """Whether the values at these places are other ones than the last, which they become."""
    moved = False
    for i in range(places.shape[0]):
        if values[places[i]] != last[i]:
            last[i] = values[places[i]]
            moved = True
    return moved
