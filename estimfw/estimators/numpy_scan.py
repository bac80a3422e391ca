"""The recursion in NumPy: a step after the other, the readable definition of the algorithm and the oracle of the tests."""

from __future__ import annotations

from copy import copy
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import NumericalError
from estimfw.estimators.scan import Chunk, ChunkResult, FilterSettings, FilterState, SubSteps, row_offsets
from estimfw.kernels import fuse, joseph, ud
from estimfw.model.nominal import BoundProvider
from estimfw.plan.completion import derived_in_loop
from estimfw.plan.plan import MeasurementPlan, Plan

__all__ = ["NumpyScan"]

FloatArray = NDArray[np.float64]

#: Matrices that are kept for steps of one length and input; a measured input rarely has one value twice.
MOST_TABLES = 1_000


class NumpyScan:
    """A plan bound to its provider and its start.

    Parameters
    ----------
    plan : Plan
    provider : BoundProvider or None
        None: the nominal is the row of the state for ever.
    settings : FilterSettings
    initial_row : (provided,) array
    prior : (n,) and (n, n) array
        Mean and covariance at the start and at every restart.
    """

    name = "numpy"

    def __init__(
        self,
        plan: Plan,
        provider: BoundProvider | None,
        settings: FilterSettings,
        initial_row: FloatArray,
        prior: tuple[FloatArray, FloatArray],
    ) -> None:
        self.plan, self.provider, self.settings = plan, provider, settings
        self.doublings = SubSteps(plan, initial_row)
        self.kernel: ModuleType = ud if settings.covariance == "ud" else joseph
        self.mean, self.form = prior[0], self.kernel.factor(prior[1])
        self.offsets = row_offsets(plan)
        self.thresholds = [plan.thresholds(m) for m in plan.measurements]
        self.steady = plan.steady
        self.inside = frozenset(d.name for d in derived_in_loop(plan))
        self.corrected = np.array(plan.corrected, dtype=bool)
        self.tables: dict[tuple[float, bytes], tuple[FloatArray, FloatArray, FloatArray]] = {}

    def begun(self, doublings: SubSteps, mean: FloatArray, form: FloatArray) -> NumpyScan:
        """The same recursion with the sub-steps and the prior of another run, its covariance in the kernel's form."""
        other = copy(self)
        other.doublings, other.mean, other.form = doublings, mean, form
        other.tables = self.tables if doublings is self.doublings else {}
        return other

    def run(self, state: FilterState, chunk: Chunk) -> tuple[FilterState, ChunkResult]:
        """K steps; see `Chunk` and `ChunkResult`."""
        result = ChunkResult.empty(self.plan, len(chunk), state.provider.shape[-1])
        for k in range(len(chunk)):
            state = self._step(state, chunk, k, result)
        return state, result

    def _step(self, state: FilterState, chunk: Chunk, k: int, result: ChunkResult) -> FilterState:
        x, form, provider = state.x, state.form, state.provider
        process_row = end_row = self._complete(state.row)
        if chunk.restart[k]:
            provider = self._correct(provider, x, end_row)
            x, form = self.mean.copy(), self.form.copy()
        if self.provider is not None:
            provider, process_row, end_row = self.provider.step(provider, chunk.samples[k])
            process_row, end_row = self._complete(process_row), self._complete(end_row)
        dt = float(chunk.dt[k])
        if dt > 0.0:
            Phi, Q, d = self._tables(process_row, chunk.inputs[k], dt)
            x = Phi @ x + d
            form = self.kernel.predict(form, Phi, Q)
        any_fused = False
        for j, m in enumerate(self.plan.measurements):
            if chunk.due[k, j]:
                x, form, fused = self._fuse(x, form, m, j, end_row, chunk, k, result)
                any_fused = any_fused or fused
        result.estimate[k], result.covariance[k] = x, self.kernel.covariance(form)
        result.rows[k], result.provider[k] = end_row[: self.plan.layout.provided], provider
        if self.settings.closed_loop and any_fused and self.provider is not None:
            provider = self._correct(provider, x, end_row)
            x = np.where(self.corrected, 0.0, x)
        return FilterState(x, form, provider, end_row[..., : self.plan.layout.provided])

    def _tables(self, row: FloatArray, u: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        key = (dt, u.tobytes())
        if self.steady and key in self.tables:
            return self.tables[key]
        made = self.plan.discretised(row, u, np.array(dt), self.doublings(dt))
        if not np.all(np.isfinite(made[0])):
            raise NumericalError("the transition matrix is not finite", hint="the dynamics are too stiff for the step")
        if self.steady and len(self.tables) < MOST_TABLES:
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

    def _fuse(
        self,
        x: FloatArray,
        form: FloatArray,
        m: MeasurementPlan,
        j: int,
        row: FloatArray,
        chunk: Chunk,
        k: int,
        result: ChunkResult,
    ) -> tuple[FloatArray, FloatArray, bool]:
        own = slice(self.offsets[j], self.offsets[j + 1])
        z = m.innovation.evaluate(row)[..., 0] + m.sign * chunk.readings[k, own]
        R = np.array(m.R) / (chunk.interval[k, j] if m.density else 1.0)
        done = fuse.fuse(self.kernel, x, form, z, m.H.evaluate(row), R, self.thresholds[j])
        result.innovation[k, own], result.sigma[k, own] = done.innovation, done.sigma
        result.nis[k, j], result.disposition[k, j], result.used[k, j] = done.nis, done.disposition, done.used
        result.log_det[k, j] = done.log_det
        return done.x, done.form, bool(done.disposition == fuse.FUSED)
