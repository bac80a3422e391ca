"""The recursion in NumPy: a step after the other, the readable definition of the algorithm and the oracle of the tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.scan import Chunk, ChunkResult, FilterSettings, FilterState
from estimfw.estimators.step_by_step import StepByStep
from estimfw.kernels import fuse, joseph, ud
from estimfw.model.nominal import BoundProvider
from estimfw.plan.plan import MeasurementPlan, Plan

__all__ = ["NumpyScan"]

FloatArray = NDArray[np.float64]


class NumpyScan(StepByStep):
    """The Kalman recursion; ``settings`` say the form of the covariance and the loop, the rest is that of `StepByStep`."""

    def __init__(
        self,
        plan: Plan,
        provider: BoundProvider | None,
        settings: FilterSettings,
        initial_row: FloatArray,
        prior: tuple[FloatArray, FloatArray],
    ) -> None:
        super().__init__(plan, provider, ud if settings.covariance == "ud" else joseph, initial_row, prior)
        self.settings, self.moves = settings, settings.moves

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
            if result.moves is not None:
                result.moves.transition[k], result.moves.noise[k], result.moves.drift[k] = Phi, Q, d
        any_fused = False
        for j, m in enumerate(self.plan.measurements):
            if chunk.due[k, j]:
                x, form, fused = self._fuse(x, form, m, j, end_row, chunk, k, result)
                any_fused = any_fused or fused
        result.estimate[k], result.covariance[k] = x, self.kernel.covariance(form)
        if result.moves is not None:
            result.moves.form[k] = form
        result.rows[k], result.provider[k] = end_row[: self.plan.layout.provided], provider
        if self.settings.closed_loop and any_fused and self.provider is not None:
            provider = self._correct(provider, x, end_row)
            x = np.where(self.corrected, 0.0, x)
        return FilterState(x, form, provider, end_row[..., : self.plan.layout.provided])

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
        H = m.H.evaluate(row)
        z = fuse.nearest(z, H @ x, m.period)
        done = fuse.fuse(self.kernel, x, form, z, H, R, self.thresholds[j], self.plan.considered)
        result.innovation[k, own], result.sigma[k, own] = done.innovation, done.sigma
        result.nis[k, j], result.disposition[k, j], result.used[k, j] = done.nis, done.disposition, done.used
        result.log_det[k, j] = done.log_det
        return done.x, done.form, bool(done.disposition == fuse.FUSED)
