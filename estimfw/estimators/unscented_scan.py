r"""The unscented filter over the error state: sigma points are states of the provider on a leading axis.

A point :math:`x_i` of the error state stands for the nominal corrected by it. Its corrected part (states with a slot) is put into
the provider by ``correct``, goes through the provider's own ``step``, and comes back by ``difference``; what has no slot is
Euclidean and follows the error model, as does what it does to the others:

.. math:: x_i' = \Phi x_i + d, \qquad
    x_{i,c}' = \mathrm{difference}\big(s', \mathrm{step}(\mathrm{correct}(s, \Phi_{cc}^{-1} (\Phi x_i + d)_c))\big)

so that rows at the end of the step know of everything, and a provider whose step is linear gives the linear filter. Q is
additive: points are drawn from :math:`P + \Phi^{-1} Q \Phi^{-T}`. A measurement predicts
:math:`y_i = -\mathrm{innovation}(row_i) + H_r x_{i,r}` (r: states without slot); one without an innovation :math:`H x_i`. All
that is due at the end of a step is joint with the state, in factors :math:`U D U'` with y before x, and is fused one measurement
after the other by `estimfw.kernels.fuse`: gates, masked components and dispositions are those of the Kalman filter.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import NumericalError, PluginError
from estimfw.estimators.scan import Chunk, ChunkResult, FilterState
from estimfw.estimators.sigma_points import Spread
from estimfw.estimators.step_by_step import StepByStep
from estimfw.kernels import fuse, ud
from estimfw.model.nominal import BoundProvider
from estimfw.plan.plan import MeasurementPlan, Plan

__all__ = ["Manifold", "UnscentedScan", "manifold_of"]

FloatArray = NDArray[np.float64]

#: A pivot that is negative by less than this part of its variance is a rounding.
ROUNDING = 1e-9


class Manifold(Protocol):
    """What an unscented filter asks of a provider with slots besides `BoundProvider`."""

    def difference(self, state: FloatArray, other: FloatArray) -> FloatArray: ...


class UnscentedScan(StepByStep):
    """The unscented recursion; parameters as for `StepByStep`.

    Raises
    ------
    PluginError
        The provider has slots that the model corrects, but no ``difference``.
    """

    def __init__(
        self,
        plan: Plan,
        provider: BoundProvider | None,
        closed_loop: bool,
        spread: Spread,
        initial_row: FloatArray,
        prior: tuple[FloatArray, FloatArray],
    ) -> None:
        super().__init__(plan, provider, ud, initial_row, prior)
        self.closed_loop, self.spread = closed_loop, spread
        self.manifold = manifold_of(provider) if provider is not None and np.any(self.corrected) else None

    def _step(self, state: FilterState, chunk: Chunk, k: int, result: ChunkResult) -> FilterState:
        x, form, provider = state.x, state.form, state.provider
        row = self._complete(state.row)
        if chunk.restart[k]:
            provider = self._correct(provider, x, row)
            x, form = self.mean.copy(), self.form.copy()
        points, provider, rows = self._predict(x, form, provider, row, chunk, k)
        x, form, any_fused = self._update(points, rows[1:], chunk, k, result)
        end_row = rows[0]
        result.estimate[k], result.covariance[k] = x, ud.covariance(form)
        result.rows[k], result.provider[k] = end_row[: self.plan.layout.provided], provider
        if self.closed_loop and any_fused and self.provider is not None:
            provider = self._correct(provider, x, end_row)
            x = np.where(self.corrected, 0.0, x)
        return FilterState(x, form, provider, end_row[: self.plan.layout.provided])

    def _predict(
        self, x: FloatArray, form: FloatArray, state: FloatArray, row: FloatArray, chunk: Chunk, k: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Points (2 n + 1, n) at the end of the step, the nominal's state there, and rows (2 n + 2, size): nominal, points."""
        process_row, end_row, after = row, row, state
        if self.provider is not None:
            after, process_row, end_row = self.provider.step(state, chunk.samples[k])
            process_row, end_row = self._complete(process_row), self._complete(end_row)
        Phi, Q, d = self._tables(process_row, chunk.inputs[k], float(chunk.dt[k]))
        back = np.linalg.inv(Phi)
        points = self._spread(x, ud.predict(form, np.eye(len(x)), back @ Q @ back.T)) @ Phi.T + d
        rows = np.broadcast_to(end_row, (len(points) + 1, *end_row.shape))
        if self.manifold is not None and self.provider is not None:
            c = self.corrected
            begun = np.zeros_like(points)
            begun[:, c] = np.linalg.solve(Phi[np.ix_(c, c)], points[:, c].T).T
            moved = self._correct(np.broadcast_to(state, (len(points), *state.shape)), begun, row)
            samples = np.broadcast_to(chunk.samples[k], (len(points), *chunk.samples[k].shape))
            there, _, own = self.provider.step(moved, samples)
            points[:, c] = self._slots(self.manifold.difference(after, there), end_row)
            rows = np.concatenate([end_row[None], self._complete(own)])
        return points, after, rows

    def _spread(self, x: FloatArray, form: FloatArray) -> FloatArray:
        root = (np.triu(form, 1) + np.eye(len(x))) * np.sqrt(np.diag(form))
        return self.spread.points(x, root)

    def _tables(self, row: FloatArray, u: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        n = len(self.plan.states)
        if not dt > 0.0:
            return np.eye(n), np.zeros((n, n)), np.zeros(n)
        return super()._tables(row, u, dt)

    def _slots(self, delta: FloatArray, row: FloatArray) -> FloatArray:
        """Corrected states (points, corrected) that correct by delta (points, 3 * slots) at this row."""
        C = self.plan.correction.evaluate(row)[:, self.corrected]
        return np.asarray(delta @ np.linalg.pinv(C).T)

    def _update(
        self, points: FloatArray, rows: FloatArray, chunk: Chunk, k: int, result: ChunkResult
    ) -> tuple[FloatArray, FloatArray, bool]:
        """Mean and factors after all that is due, and whether anything was fused."""
        due = [j for j in range(len(self.plan.measurements)) if chunk.due[k, j]]
        predicted = [self._predicted(self.plan.measurements[j], points, rows) for j in due]
        joint = np.concatenate([*predicted, points], axis=1)
        in_mean, in_covariance = self.spread.weights(points.shape[1])
        mean = in_mean @ joint
        aside = joint - mean
        form = _factors((aside * in_covariance[:, None]).T @ aside)
        at, any_fused = 0, False
        for j, y in zip(due, predicted, strict=True):
            mean, form, fused = self._fuse(mean, form, at, y.shape[1], j, chunk, k, result)
            any_fused, at = any_fused or fused, at + y.shape[1]
        return mean[at:], form[at:, at:], any_fused

    def _predicted(self, m: MeasurementPlan, points: FloatArray, rows: FloatArray) -> FloatArray:
        """What the readings would be of each point, but for their sign and noise, (points, rows)."""
        H = m.H.evaluate(rows)
        if not m.innovation.monomials:
            return np.asarray(np.einsum("pij,pj->pi", H, points))
        euclidean = np.where(self.corrected, 0.0, points)
        predicted = np.asarray(np.einsum("pij,pj->pi", H, euclidean) - m.innovation.evaluate(rows)[..., 0])
        return fuse.nearest(predicted, predicted[:1], m.period)

    def _fuse(
        self,
        mean: FloatArray,
        form: FloatArray,
        at: int,
        count: int,
        j: int,
        chunk: Chunk,
        k: int,
        result: ChunkResult,
    ) -> tuple[FloatArray, FloatArray, bool]:
        m, own = self.plan.measurements[j], slice(self.offsets[j], self.offsets[j + 1])
        z = fuse.nearest(m.sign * chunk.readings[k, own], mean[at : at + count], m.period)
        R = np.array(m.R) / (chunk.interval[k, j] if m.density else 1.0)
        done = fuse.fuse(ud, mean, form, z, np.eye(count, len(mean), at), R, self.thresholds[j])
        result.innovation[k, own], result.sigma[k, own] = done.innovation, done.sigma
        result.nis[k, j], result.disposition[k, j], result.used[k, j] = done.nis, done.disposition, done.used
        result.log_det[k, j] = done.log_det
        return done.x, done.form, bool(done.disposition == fuse.FUSED)


def manifold_of(provider: BoundProvider) -> Manifold:
    """The provider, if it can tell how far two of its states are apart; PluginError if not."""
    if not callable(getattr(provider, "difference", None)):
        raise PluginError(
            "the nominal provider has no `difference(state, other)`, which tells how far two states are apart",
            hint="it is the inverse of `correct`: correct(state, difference(state, other)) is other; kind: kalman needs none",
        )
    return provider  # type: ignore[return-value]


def _factors(P: FloatArray) -> FloatArray:
    """U and D of P, without the negative pivots that roundings leave."""
    form = ud.factor(P)
    pivots, variances = np.diag(form), np.diag(P)
    if np.any(pivots < -ROUNDING * np.abs(variances)):
        raise NumericalError(
            "the covariance of the sigma points is not positive",
            hint="alpha: 1 and kappa: 0 have positive weights only",
        )
    np.fill_diagonal(form, np.maximum(pivots, 0.0))
    return form
