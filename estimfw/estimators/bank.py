"""A bank: filters of one plan over one record, from several starts, judged by the likelihood of what they measured.

Member m is charged ``J_m = sum over epochs and measurements of NIS + ln det S``, which is ``-2 ln p`` of its innovations but
for a constant that all members share. With equal weights before the first measurement, its weight after it is
``w_m = exp(-J_m / 2) / sum exp(-J / 2)``: the posterior probability of its start, if one of the starts is right (D. T. Magill,
"Optimal adaptive estimation of sampled stochastic processes", IEEE Trans. Autom. Control 10 (1965) 434). Reported is the member
with the lowest J.

A gated measurement is charged the largest NIS that would have been fused: a member that refuses what contradicts it gains
nothing by that, and one outlier decides nothing. One that is missing, or cannot be judged, is charged nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.scan import ChunkResult, lost
from estimfw.kernels.fuse import GATED
from estimfw.plan.plan import Plan

__all__ = ["Judged", "charged", "judge", "reported", "weights"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Judged:
    """``score``: J (K, members) after each of K steps; ``best``: the place (K,) of the lowest, the first of equal ones."""

    score: FloatArray
    best: IntArray


def judge(plan: Plan, results: Sequence[ChunkResult], before: FloatArray, *, scored: bool) -> Judged:
    """Charge the members for K steps.

    Parameters
    ----------
    plan : Plan
    results : sequence of ChunkResult
        One of each member.
    before : (members,) array
        J before these steps.
    scored : bool
        False: a plain filter, which nobody judges.
    """
    if not scored:
        steps = results[0].estimate.shape[0]
        return Judged(np.zeros((steps, 1)), np.zeros(steps, dtype=np.int64))
    score = np.stack([charged(plan, r, float(b)) for r, b in zip(results, before, strict=True)], axis=-1)
    return Judged(score, np.asarray(np.argmin(score, axis=-1), dtype=np.int64))


def charged(plan: Plan, result: ChunkResult, before: float) -> FloatArray:
    """J (K,) of one member after each of K steps; infinite from where its numbers are lost.

    Parameters
    ----------
    plan : Plan
    result : ChunkResult
        Of that member.
    before : float
        Its J before these steps.
    """
    nis, at = result.nis.copy(), 0
    for j, m in enumerate(plan.measurements):
        limit = plan.thresholds(m)
        if limit is not None:
            usable = np.isfinite(result.innovation[:, at : at + m.rows]).sum(axis=1)
            nis[:, j] = np.where(result.disposition[:, j] == GATED, limit[usable], nis[:, j])
        at += m.rows
    known = np.isfinite(result.log_det) & np.isfinite(nis)
    each = np.where(known, nis + result.log_det, 0.0).sum(axis=1)
    total = np.cumsum(np.concatenate([[before], each]))[1:]
    return np.where(np.logical_or.accumulate(np.any(lost(result), axis=1)), np.inf, total)


def weights(score: FloatArray) -> FloatArray:
    """Weights (..., members) that sum to one, for J of the same shape; all equal where every member is lost."""
    lowest = np.min(score, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        raw = np.where(np.isfinite(lowest), np.exp(-0.5 * (score - lowest)), 1.0)
    return np.asarray(raw / np.sum(raw, axis=-1, keepdims=True))


def reported(results: Sequence[ChunkResult], best: IntArray) -> ChunkResult:
    """The rows of the best member at each step."""
    if len(results) == 1:
        return results[0]
    steps = np.arange(best.size)
    names = [f.name for f in fields(ChunkResult) if f.name != "moves"]
    made: dict[str, Any] = {name: np.stack([getattr(r, name) for r in results])[best, steps] for name in names}
    return ChunkResult(**made)
