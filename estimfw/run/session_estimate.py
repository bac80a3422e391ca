"""What a session tells after each step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.estimators.scan import ChunkResult
from estimfw.kernels.fuse import LATE, MEANINGS
from estimfw.run.outputs import output_values
from estimfw.run.session_smoother import SmoothedEstimate

__all__ = ["Estimate", "estimate_of"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Estimate:
    """The filter after a step.

    ``states`` and ``outputs`` map a label to (value, sigma) in SI; ``covariance`` is (n, n). ``dispositions`` says what became of
    each measurement that was due, or late since the step before; ``nis`` holds the NIS of those that were due.
    Of a bank it is the likeliest ``member``; ``weights`` are those of all, see `estimfw.estimators.bank`.
    ``smoothed`` are, with ``smoother: {kind: fixed_lag}``, the states that the lag has passed since the step before, the earliest
    first: mostly one, none while the session is shorter than the lag.
    """

    time: float
    states: Mapping[str, tuple[float, float]]
    outputs: Mapping[str, tuple[float, float]]
    covariance: FloatArray
    dispositions: Mapping[str, str]
    nis: Mapping[str, float]
    member: str = ""
    weights: Mapping[str, float] = field(default_factory=dict)
    smoothed: tuple[SmoothedEstimate, ...] = ()


def estimate_of(problem: Problem, result: ChunkResult, time: float, late: Iterable[str]) -> Estimate:
    """After a step, the only one of ``result``; ``late`` are measurements of which rows came too late since the step before."""
    plan = problem.plan
    rows = plan.layout.complete(result.rows)
    sigma = np.sqrt(np.maximum(np.diag(result.covariance[0]), 0.0))
    outputs: dict[str, tuple[float, float]] = {}
    for output, jacobian in plan.outputs:
        value, spread = output_values(problem, output, jacobian, result, rows)
        outputs |= {label: (float(value[0, i]), float(spread[0, i])) for i, label in enumerate(output.labels)}
    codes = {m.name: int(result.disposition[0, j]) for j, m in enumerate(plan.measurements)}
    due = {name: MEANINGS[code] for name, code in codes.items() if code >= 0}
    return Estimate(
        time=time,
        states={s: (float(result.estimate[0, i]), float(sigma[i])) for i, s in enumerate(plan.states)},
        outputs=outputs,
        covariance=result.covariance[0],
        dispositions=dict.fromkeys(late, MEANINGS[LATE]) | due,
        nis={m.name: float(result.nis[0, j]) for j, m in enumerate(plan.measurements) if m.name in due},
    )
