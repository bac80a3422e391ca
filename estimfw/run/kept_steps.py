"""The linear steps of a run, kept for analyses that go over them again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.suboptimal import LinearStep, linear_steps
from estimfw.estimators.stretch import Stretch

__all__ = ["KeptSteps"]

FloatArray = NDArray[np.float64]

#: Numbers of Phi and Q that are kept at most (512 MiB).
MOST_NUMBERS = 1 << 26


class KeptSteps:
    """Watches a run; steps that share their matrices share them in memory, too.

    Attributes
    ----------
    steps : list of LinearStep
        Since the last restart.
    prior_mean, prior : (n,) and (n, n) array
        What they begin with.
    mean_transition : (n, n) array
        Mean of |Phi| over all steps.
    lost : str
        Why the steps are not kept; empty where they are.
    """

    def __init__(self, states: int) -> None:
        self.steps: list[LinearStep] = []
        self.prior_mean, self.prior = np.zeros(states), np.zeros((states, states))
        self.lost = ""
        self._total, self._count, self._numbers = np.zeros((states, states)), 0, 0

    @property
    def mean_transition(self) -> FloatArray:
        return self._total / max(1, self._count)

    def __call__(self, stretch: Stretch) -> None:
        self.prior_mean, self.prior = stretch.prior_mean, stretch.prior
        for step, restart in zip(linear_steps(stretch), stretch.chunk.restart.tolist(), strict=True):
            self._total += np.abs(step.Phi)
            self._count += 1
            if restart:
                self.steps.clear()
                self._numbers = 0
            if not self.lost:
                self._keep(step)

    def _keep(self, step: LinearStep) -> None:
        last = self.steps[-1] if self.steps else None
        if last is not None and np.array_equal(step.Phi, last.Phi) and np.array_equal(step.Q, last.Q):
            step = replace(step, Phi=last.Phi, Q=last.Q)
        else:
            step = replace(step, Phi=step.Phi.copy(), Q=step.Q.copy())
            self._numbers += 2 * step.Phi.size
        step = replace(step, H=step.H.copy(), R=step.R.copy())
        self.steps.append(step)
        if self._numbers > MOST_NUMBERS:
            self.lost = f"{self._count} steps whose Phi differ do not fit into memory; shorten the record"
            self.steps.clear()
