"""Dual covariance analysis: what the errors of a filter really are when its model is not the real one.

The gains of the filter, as it ran, act on a truth model. Joint state ``[x; e; 1]``: ``x`` the errors of the nominal and the
sensors in the truth model, ``e = M x - x_hat`` the error of the filter's states (M the map of the policies), and a one that
carries means and known inputs. In these coordinates nothing is lost to the size of x:

    predict   x <- Phi_t x + w,              e <- Phi_f e + (M Phi_t - Phi_f M) x + M w
    update    e <- (I - K H_f) e - K (H_t - H_f M) x - K v
    correct   x <- x - U C_f x_hat,          e <- M x - Z x_hat,     x_hat = M x - e

with C_f what the provider is corrected by (in closed loop, and at restarts), U = C_t^T what that takes off the truth, Z zero for
the corrected states.

What the models differ by (all that multiplies x) is evaluated at the nominal corrected by the estimate, also in open loop: a
variable that a policy holds at its true value costs nothing, however far off the filter began. What multiplies e is evaluated
where the filter ran: where the models do not differ, the moments of e are the filter's own covariance. So the error of an open
loop's own linearisation, of second order in its misalignment, is not in it: it is no property of a reduction.

Sources: Maybeck, Stochastic Models, Estimation and Control, vol. 1, section 6.8; Brown and Hwang on suboptimal filters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.error_sources import Source
from estimfw.estimators.scan import SubSteps
from estimfw.estimators.stretch import Stretch
from estimfw.plan.truth_plan import TruthPlan

__all__ = ["DualCovariance", "JointMoments"]

FloatArray = NDArray[np.float64]

#: Numbers that the matrices of one batch of steps may hold.
BATCH = 1 << 20


@dataclass(frozen=True)
class JointMoments:
    """Second moments of the joint state after the updates of some steps.

    Attributes
    ----------
    steps : slice
        Of the stretch.
    moments : (K, S, N, N) array
        By source; N = truth states + filter states + 1.
    map : (K, n, truth states) array
        M at the end of each step.
    """

    steps: slice
    moments: FloatArray
    map: FloatArray

    def states(self) -> FloatArray:
        """Second moments of the errors of the filter's states, (K, S, n, n)."""
        own = slice(self.map.shape[-1], self.map.shape[-1] + self.map.shape[-2])
        return self.moments[..., own, own]

    def outputs(self, ran: FloatArray, own: FloatArray, true: FloatArray) -> FloatArray:
        """Mean squares (K, S, components) of the errors of outputs.

        Parameters
        ----------
        ran, own : (K, components, n) array
            Jacobians over the filter's states, where it ran and at the corrected nominal.
        true : (K, components, truth states) array
            The truth's at the corrected nominal.
        """
        J = np.concatenate([own @ self.map - true, -ran, np.zeros((*own.shape[:-1], 1))], axis=-1)
        return np.asarray(np.einsum("kci,ksij,kcj->ksc", J, self.moments, J, optimize=True))


class DualCovariance:
    """The recursion along the stretches of one run.

    Parameters
    ----------
    truth : TruthPlan
    sources : sequence of Source
        What is told apart; see `estimfw.analysis.error_sources`.
    initial_row : (provided,) array
        The nominal at the start.
    """

    def __init__(self, truth: TruthPlan, sources: Sequence[Source], initial_row: FloatArray) -> None:
        self.truth, self.sources = truth, tuple(sources)
        row = truth.plan.layout.complete(initial_row)
        self._doublings = SubSteps(truth.plan, initial_row)
        self._moments = np.stack([s.initial for s in sources])
        self._map = truth.map.evaluate(row)
        n = self._moments.shape[-1]
        self._correct, self._restart = np.eye(n), np.eye(n)

    def advance(self, stretch: Stretch) -> Iterator[JointMoments]:
        """The moments along the next stretch, in batches."""
        n = self._moments.shape[-1]
        length = max(1, BATCH // (n * n * len(self.sources)))
        for first in range(0, len(stretch), length):
            own = slice(first, min(first + length, len(stretch)))
            T, N, M = self._matrices(stretch, own)
            moments = np.empty((len(T), *self._moments.shape))
            P = self._moments
            for k in range(len(T)):
                P = T[k] @ P @ T[k].T + N[k]
                moments[k] = P
            moments = 0.5 * (moments + np.swapaxes(moments, -1, -2))
            self._moments = moments[-1]
            yield JointMoments(own, moments, M)

    def _matrices(self, stretch: Stretch, own: slice) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Transition (K, N, N) and noise (K, S, N, N) of the joint state from update to update, and M (K, n, truth states)."""
        truth, chunk = self.truth, stretch.chunk
        end = truth.plan.layout.complete(stretch.best_rows[1][own])
        M = truth.map.evaluate(end)
        before = np.concatenate([self._map[None], M[:-1]])
        Phi, Q, _ = stretch.plan.transitions(stretch.rows[0][own], chunk.inputs[own], chunk.dt[own], stretch.doublings)
        K = gains(stretch, own, Phi, Q)
        A, W = self._predicted(stretch, own, Phi, before, M)
        B = self._updated(stretch, own, K, M, end)
        T, N = B @ A, B[:, None] @ W @ np.swapaxes(B, -1, -2)[:, None]
        N += self._readings(stretch.plan.noise(chunk.interval[own]), K)
        correct, restart = self._corrections(stretch, own, M)
        first = np.concatenate([self._correct[None], correct[:-1]])
        anew = np.concatenate([self._restart[None], restart[:-1]])
        first = np.where(chunk.restart[own][:, None, None], anew @ first, first)
        self._map, self._correct, self._restart = M[-1], correct[-1], restart[-1]
        return T @ first, N, M

    def _predicted(
        self, stretch: Stretch, own: slice, ran: FloatArray, before: FloatArray, after: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """A (K, N, N) and the process noise (K, S, N, N) of the predictions."""
        plan, truth, chunk = stretch.plan, self.truth.plan, stretch.chunk
        process, dt, u = stretch.best_rows[0][own], chunk.dt[own], chunk.inputs[own]
        Phi_f, _, d_f = plan.transitions(plan.layout.complete(process), u, dt, stretch.doublings)
        row = truth.layout.complete(process)
        u = u[:, list(self.truth.inputs)]
        Phi_t, Q, d_t = truth.transitions(row, u, dt, self._doublings)
        a, n = truth.F.shape[0], plan.F.shape[0]
        A = np.zeros((len(dt), a + n + 1, a + n + 1))
        A[:, :a, :a], A[:, a:-1, a:-1], A[:, -1, -1] = Phi_t, ran, 1.0
        A[:, a:-1, :a] = after @ Phi_t - Phi_f @ before
        A[:, :a, -1], A[:, a:-1, -1] = d_t, np.einsum("kij,kj->ki", after, d_t) - d_f
        spread = np.zeros((len(dt), a + n + 1, a))
        spread[:, :a], spread[:, a:-1] = np.eye(a), after
        W = np.zeros((len(dt), len(self.sources), a + n + 1, a + n + 1))
        for i, source in enumerate(self.sources):
            if source.noises == "all":
                W[:, i] = spread @ Q @ np.swapaxes(spread, -1, -2)
            for noise in () if source.noises == "all" else source.noises:
                alone = replace(truth, D=self.truth.noises[noise][1])
                W[:, i] += spread @ alone.transitions(row, u, dt, self._doublings)[1] @ np.swapaxes(spread, -1, -2)
        return A, W

    def _updated(self, stretch: Stretch, own: slice, K: FloatArray, M: FloatArray, end: FloatArray) -> FloatArray:
        """B (K, N, N) of the updates with the gains K (K, n, rows) of the filter."""
        plan = stretch.plan
        H_f, H_t = plan.design(plan.layout.complete(stretch.best_rows[1][own])), self.truth.design(end)
        a, n = M.shape[-1], M.shape[-2]
        B = np.broadcast_to(np.eye(a + n + 1), (len(K), a + n + 1, a + n + 1)).copy()
        B[:, a:-1, :a] = -K @ (H_t - H_f @ M)
        B[:, a:-1, a:-1] -= K @ plan.design(stretch.rows[1][own])
        return B

    def _readings(self, R: FloatArray, K: FloatArray) -> FloatArray:
        """The measurement noise's part (K, S, N, N)."""
        size, n = self._moments.shape[-1], K.shape[-2]
        N = np.zeros((len(K), len(self.sources), size, size))
        for i, source in enumerate(self.sources):
            rows = slice(None) if source.readings == "all" else list(source.readings)
            part = K[..., rows]
            noise = R[:, rows][..., rows]
            N[:, i, size - 1 - n : -1, size - 1 - n : -1] = part @ noise @ np.swapaxes(part, -1, -2)
        return N

    def _corrections(self, stretch: Stretch, own: slice, M: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What follows the updates: a correction of the provider (K, N, N), and one with a new start."""
        plan, (n, a) = stretch.plan, M.shape[-2:]
        row = stretch.best_rows[1][own]
        C_f = plan.correction.evaluate(plan.layout.complete(row))
        C_t = self.truth.plan.correction.evaluate(self.truth.plan.layout.complete(row))
        off = np.swapaxes(C_t, -1, -2) @ C_f  # what the estimate takes off the truth, (K, a, n)
        correct = np.broadcast_to(np.eye(a + n + 1), (len(M), a + n + 1, a + n + 1)).copy()
        correct[:, :a, :a] -= off @ M
        correct[:, :a, a:-1] = off
        restart = correct.copy()
        taken = np.diag(~np.array(plan.corrected, dtype=bool)).astype(float) + M @ off  # of x_hat, to have the new e
        correct[:, a:-1, :a], correct[:, a:-1, a:-1] = M - taken @ M, taken
        restart[:, a:-1, :a], restart[:, a:-1, a:-1] = M - M @ off @ M, M @ off
        restart[:, a:-1, -1] = -stretch.prior_mean
        correct[~stretch.corrected[own]] = np.eye(a + n + 1)
        return correct, restart


def gains(stretch: Stretch, own: slice, Phi: FloatArray, Q: FloatArray) -> FloatArray:
    """The gains (K, n, rows) of the updates that were made, zero for what was not fused; Phi, Q (K, n, n) as they were."""
    plan, chunk = stretch.plan, stretch.chunk
    known = np.concatenate([stretch.covariance_before[None], stretch.result.covariance])[own.start : own.stop]
    P = np.where(chunk.restart[own][:, None, None], stretch.prior, known)
    P = Phi @ P @ np.swapaxes(Phi, -1, -2) + Q
    fused = stretch.usable[own].astype(float)
    H = plan.design(stretch.rows[1][own]) * fused[:, :, None]
    R = plan.noise(chunk.interval[own]) * fused[:, :, None] * fused[:, None, :]
    S = H @ P @ np.swapaxes(H, -1, -2) + R
    S[:, range(S.shape[-1]), range(S.shape[-1])] += 1.0 - fused
    return np.swapaxes(np.linalg.solve(S, H @ P), -1, -2)
