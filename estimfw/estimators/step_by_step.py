"""What recursions in NumPy have in common: a plan bound to its provider and its start, taken a step after the other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from copy import copy
from types import ModuleType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import NumericalError
from estimfw.estimators.scan import Chunk, ChunkResult, FilterState, SubSteps, row_offsets
from estimfw.model.nominal import BoundProvider
from estimfw.plan.completion import derived_in_loop
from estimfw.plan.plan import Plan
from estimfw.plan.stages import Stage, in_stage

__all__ = ["StepByStep"]

FloatArray = NDArray[np.float64]

#: Matrices that are kept for steps of one length, nominal and input; a measured input rarely has one value twice.
MOST_TABLES = 1_000


class StepByStep(ABC):
    """A plan bound to its provider and its start.

    Parameters
    ----------
    plan : Plan
    provider : BoundProvider or None
        None: the nominal is the row of the state for ever.
    kernel : module
        `estimfw.kernels.ud` or `estimfw.kernels.joseph`: the form of the covariance.
    initial_row : (provided,) array
    prior : (n,) and (n, n) array
        Mean and covariance at the start and at every restart.
    """

    name = "numpy"
    moves = False
    """Whether the result keeps them, see `estimfw.estimators.scan.Moves`."""

    def __init__(
        self,
        plan: Plan,
        provider: BoundProvider | None,
        kernel: ModuleType,
        initial_row: FloatArray,
        prior: tuple[FloatArray, FloatArray],
    ) -> None:
        self.plan, self.provider, self.kernel = plan, provider, kernel
        self.doublings = SubSteps(plan, initial_row)
        self.mean, self.form = prior[0], kernel.factor(prior[1])
        self.offsets = row_offsets(plan)
        self.thresholds = [plan.thresholds(m) for m in plan.measurements]
        self.watched = np.array(plan.watched, dtype=np.int64)
        self.most_tables = 1 if plan.pace == "varying" else MOST_TABLES
        self.inside = frozenset(d.name for d in derived_in_loop(plan))
        self.corrected = np.array(plan.corrected, dtype=bool)
        self.tables: dict[tuple[float, bytes], tuple[FloatArray, FloatArray, FloatArray]] = {}

    def begun(self, doublings: SubSteps, mean: FloatArray, form: FloatArray) -> Self:
        """The same recursion with the sub-steps and the prior of another run, its covariance in the kernel's form."""
        other = copy(self)
        other.doublings, other.mean, other.form = doublings, mean, form
        other.tables = self.tables if doublings is self.doublings else {}
        return other

    def in_stage(self, stage: Stage) -> Self:
        """The same recursion in a stage of its plan, see `estimfw.plan.stages`."""
        other = copy(self)
        other.plan, other.tables = in_stage(self.plan, stage), {}
        return other

    def run(self, state: FilterState, chunk: Chunk) -> tuple[FilterState, ChunkResult]:
        """K steps; see `Chunk` and `ChunkResult`."""
        result = ChunkResult.empty(self.plan, len(chunk), state.provider.shape[-1], self.moves)
        for k in range(len(chunk)):
            state = self._step(state, chunk, k, result)
        return state, result

    @abstractmethod
    def _step(self, state: FilterState, chunk: Chunk, k: int, result: ChunkResult) -> FilterState: ...

    def _tables(self, row: FloatArray, u: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Phi, Q and d; made once for all steps in which nothing differs that they depend on."""
        key = (dt, u.tobytes() + row[self.watched].tobytes())
        if key in self.tables:
            return self.tables[key]
        made = self.plan.discretised(row, u, np.array(dt), self.doublings(dt))
        if not np.all(np.isfinite(made[0])):
            raise NumericalError("the transition matrix is not finite", hint="the dynamics are too stiff for the step")
        if len(self.tables) >= self.most_tables:
            self.tables.pop(next(iter(self.tables)))
        self.tables[key] = made
        return made

    def _complete(self, rows: FloatArray) -> FloatArray:
        """With the derived variables that the loop needs."""
        return self.plan.layout.complete(rows, self.inside)

    def _correct(self, provider: FloatArray, x: FloatArray, row: FloatArray) -> FloatArray:
        """The provider's state, corrected by the estimate in the frames of its slots."""
        if self.provider is None or not np.any(self.corrected):
            return provider
        delta = np.einsum("...ij,...j->...i", self.plan.correction.evaluate(row), x)
        return self.provider.correct(provider, delta)
