"""Fixed lag in a session: with each step the states that a lag has passed since."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.config.generic.smoother import FixedIntervalConfig, FixedLagConfig
from estimfw.errors import UsageError
from estimfw.estimators.fixed_lag import FixedLag, Lagged
from estimfw.estimators.links import Linker
from estimfw.estimators.stretch import Stretch
from estimfw.kernels import ud
from estimfw.run.smoothing import smoothed_outputs

__all__ = ["SessionSmoother", "SmoothedEstimate"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SmoothedEstimate:
    """The state at ``time``, by all data up to the lag after it; ``states``, ``outputs``, ``covariance`` as in an `Estimate`."""

    time: float
    states: Mapping[str, tuple[float, float]]
    outputs: Mapping[str, tuple[float, float]]
    covariance: FloatArray


class SessionSmoother:
    """Smooths the steps of a session.

    Parameters
    ----------
    problem : Problem
    cfg : FixedIntervalConfig or FixedLagConfig
    kernel : module
        See `estimfw.run.smoothing.smoothing_kernel`.

    Raises
    ------
    UsageError
        The config asks for a smoother that needs the whole record.
    """

    def __init__(self, problem: Problem, cfg: FixedIntervalConfig | FixedLagConfig, kernel: ModuleType) -> None:
        if not isinstance(cfg, FixedLagConfig):
            raise UsageError(
                "a session cannot smooth over an interval that has not ended",
                hint="estimator.smoother: {kind: fixed_lag, lag: 60 s}, or none",
            )
        self._problem, self._lag = problem, FixedLag(cfg.lag, kernel)
        self._linked = Linker(kernel, factored=problem.estimator.covariance == "ud")
        self._rows: deque[FloatArray] = deque()

    def step(self, stretch: Stretch) -> tuple[SmoothedEstimate, ...]:
        """The states that the lag has passed since the step before, the earliest first; of one step."""
        self._rows.extend(stretch.result.rows)
        done = self._lag.push(stretch.time, self._linked(stretch), stretch.result.estimate)
        return tuple(self._told(one) for one in done)

    def _told(self, one: Lagged) -> SmoothedEstimate:
        plan = self._problem.plan
        row = self._rows.popleft()
        values, spreads = smoothed_outputs(self._problem, one.estimate[None], one.form[None], row[None])
        labels = [label for output, _ in plan.outputs for label in output.labels]
        covariance = ud.covariance(one.form)
        sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        return SmoothedEstimate(
            time=one.time,
            states=_pairs(plan.states, one.estimate, sigma),
            outputs=_pairs(labels, values[0], spreads[0]),
            covariance=covariance,
        )


def _pairs(
    labels: list[str] | tuple[str, ...], values: FloatArray, sigmas: FloatArray
) -> dict[str, tuple[float, float]]:
    return dict(zip(labels, zip(values.tolist(), sigmas.tolist(), strict=True), strict=True))
