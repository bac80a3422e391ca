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
loop's own linearisation, of second order in its misalignment, is not in it: it is no property of a reduction. Both models are
discretised as the filter is.

Sources: Maybeck, Stochastic Models, Estimation and Control, vol. 1, section 6.8; Brown and Hwang on suboptimal filters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.error_sources import Source
from estimfw.errors import NumericalError
from estimfw.estimators.scan import SubSteps
from estimfw.estimators.stretch import Stretch
from estimfw.kernels.fuse import decorrelate
from estimfw.plan.truth_plan import TruthPlan

__all__ = ["DualCovariance", "JointMoments"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Numbers that the matrices of one batch of steps may hold.
BATCH = 1 << 20


@dataclass(frozen=True)
class JointMoments:
    """Second moments of the joint state after the updates of some steps, by source.

    Attributes
    ----------
    steps : (K,) array of int
        Of the stretch.
    factor : (K, N, C) array
        Columns of a factor of the moments that the sources bring at the start; N = truth states + filter states + 1.
    column_source : (C,) array of int
        Source of each column.
    noise : (K, W, N, N) array
        Moments that noises have brought since.
    noise_source : (W,) array of int
        Source of each.
    sources : int
    map : (K, n, truth states) array
        M at the end of each step.
    """

    steps: IntArray
    factor: FloatArray
    column_source: IntArray
    noise: FloatArray
    noise_source: IntArray
    sources: int
    map: FloatArray

    def state_covariance(self) -> FloatArray:
        """Second moments of the errors of the filter's states, all sources together, (K, n, n)."""
        own = self._own
        E = self.factor[:, own]
        return np.asarray(E @ np.swapaxes(E, -1, -2) + self.noise[:, :, own, own].sum(axis=1))

    def states(self) -> FloatArray:
        """Mean squares of the errors of the filter's states by source, (K, S, n)."""
        squares = self.factor[:, self._own] ** 2
        variances = np.einsum("kwii->kwi", self.noise[:, :, self._own, self._own])
        return self._by_source(squares, variances)

    def outputs(self, ran: FloatArray, own: FloatArray, true: FloatArray) -> FloatArray:
        """Mean squares (K, S, components) of the errors of outputs by source.

        Parameters
        ----------
        ran, own : (K, components, n) array
            Jacobians over the filter's states, where it ran and at the corrected nominal.
        true : (K, components, truth states) array
            The truth's at the corrected nominal.
        """
        J = np.concatenate([own @ self.map - true, -ran, np.zeros((*own.shape[:-1], 1))], axis=-1)
        variances = np.einsum("kci,kwij,kcj->kwc", J, self.noise, J, optimize=True)
        return self._by_source((J @ self.factor) ** 2, variances)

    @property
    def _own(self) -> slice:
        return slice(self.map.shape[-1], self.map.shape[-1] + self.map.shape[-2])

    def _by_source(self, squares: FloatArray, variances: FloatArray) -> FloatArray:
        """(K, c, C) of columns and (K, W, c) of noises to (K, S, c)."""
        belongs = np.zeros((squares.shape[-1], self.sources))
        belongs[np.arange(squares.shape[-1]), self.column_source] = 1.0
        total = np.swapaxes(squares @ belongs, -1, -2)
        for w, source in enumerate(self.noise_source):
            total[:, source] += np.maximum(variances[:, w], 0.0)
        return np.asarray(total)


class DualCovariance:
    """The recursion along the stretches of one run.

    What is there at the start is carried as columns, so that a prior of any size loses nothing in the differences; only what
    noises bring is carried as covariances.

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
        self._doublings = SubSteps(truth.plan, initial_row)
        self._factor = np.concatenate([s.initial for s in sources], axis=1)
        self._column_source = np.repeat(np.arange(len(sources)), [s.initial.shape[1] for s in sources])
        noisy = [i for i, s in enumerate(sources) if s.noises or s.readings]
        n = self._factor.shape[0]
        self._noise_source, self._noise = np.array(noisy, dtype=np.int64), np.zeros((len(noisy), n, n))
        self._map = truth.map.evaluate(truth.plan.layout.complete(initial_row))
        self._correct, self._restart = np.eye(n), np.eye(n)
        self._made: dict[float, FloatArray] = {}
        self._apart = any(s.noises not in ((), "all") for s in sources)

    def advance(self, stretch: Stretch, keep: IntArray | None = None) -> Iterator[JointMoments]:
        """The moments along the next stretch, in batches.

        Parameters
        ----------
        stretch : Stretch
        keep : array of int, optional
            Steps of the stretch that are wanted, ascending; all.

        Raises
        ------
        NumericalError
            They left the numbers, with the time.
        """
        wanted = np.arange(len(stretch)) if keep is None else keep
        n = self._factor.shape[0]
        length = max(1, BATCH // (n * n))
        for first in range(0, len(stretch), length):
            own = slice(first, min(first + length, len(stretch)))
            inside = wanted[(wanted >= own.start) & (wanted < own.stop)]
            with np.errstate(over="ignore", invalid="ignore"):
                yield self._batch(stretch, own, inside)

    def _batch(self, stretch: Stretch, own: slice, inside: IntArray) -> JointMoments:
        T, spread, Q, K, R, M = self._matrices(stretch, own)
        factors = np.empty((len(inside), *self._factor.shape))
        noises = np.empty((len(inside), *self._noise.shape))
        at = dict(zip(inside.tolist(), range(len(inside)), strict=True))
        F, P = self._factor, self._noise
        for k in range(len(T)):
            F, P = T[k] @ F, T[k] @ P @ T[k].T + self._brought(spread[k], Q[k], K[k], R[k])
            P = 0.5 * (P + np.swapaxes(P, -1, -2))
            place = at.get(own.start + k)
            if place is not None:
                factors[place], noises[place] = F, P
        if not (np.all(np.isfinite(F)) and np.all(np.isfinite(P))):
            raise NumericalError(
                f"the errors on the truth model left the numbers before t = {stretch.time[own.stop - 1]:g} s",
                hint="a state that the filter does not have grows without bound",
            )
        self._factor, self._noise = F, P
        sources = len(self.sources)
        return JointMoments(
            inside, factors, self._column_source, noises, self._noise_source, sources, M[inside - own.start]
        )

    def _brought(self, spread: FloatArray, Q: FloatArray, K: FloatArray, R: FloatArray) -> FloatArray:
        """What the noises of one step bring, (W, N, N)."""
        made = np.zeros_like(self._noise)
        n = K.shape[0]
        for w, i in enumerate(self._noise_source):
            source = self.sources[i]
            if source.noises == "all":
                made[w] = spread @ Q.sum(axis=0) @ spread.T
            elif source.noises:
                made[w] = spread @ Q[list(source.noises)].sum(axis=0) @ spread.T
            if source.readings:
                rows = slice(None) if source.readings == "all" else list(source.readings)
                part = K[:, rows]
                made[w, -1 - n : -1, -1 - n : -1] += part @ R[rows][:, rows] @ part.T
        return made

    def _matrices(self, stretch: Stretch, own: slice) -> tuple[FloatArray, ...]:
        """Of the steps from update to update.

        The transition (K, N, N) of the joint state, what takes the truth's process noise to it (K, N, truth states), that noise
        (K, noise inputs or 1, truth states, truth states), the gains (K, n, rows), the truth's R (K, rows, rows), M.
        """
        truth, chunk = self.truth, stretch.chunk
        end = truth.plan.layout.complete(stretch.best_rows[1][own])
        M = truth.map.evaluate(end)
        before = np.concatenate([self._map[None], M[:-1]])
        Phi, Q, _ = stretch.plan.transitions(stretch.rows[0][own], chunk.inputs[own], chunk.dt[own], stretch.doublings)
        K = gains(stretch, own, Phi, Q)
        A, spread, Q = self._predicted(stretch, own, Phi, before, M)
        B = self._updated(stretch, own, K, M, end)
        correct, restart = self._corrections(stretch, own, M)
        first = np.concatenate([self._correct[None], correct[:-1]])
        anew = np.concatenate([self._restart[None], restart[:-1]])
        first = np.where(chunk.restart[own][:, None, None], anew @ first, first)
        self._map, self._correct, self._restart = M[-1], correct[-1], restart[-1]
        R = truth.noise(chunk.interval[own])
        noise = self._process_noise(stretch, own) if self._apart else Q[:, None]
        return B @ A @ first, B @ spread, noise, K, R, M

    def _predicted(
        self, stretch: Stretch, own: slice, ran: FloatArray, before: FloatArray, after: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A (K, N, N) of the predictions, what takes the truth's process noise to the joint state (K, N, truth states), its Q."""
        plan, truth, chunk = stretch.plan, self.truth.plan, stretch.chunk
        process, dt, u = stretch.best_rows[0][own], chunk.dt[own], chunk.inputs[own]
        Phi_f, _, d_f = plan.transitions(plan.layout.complete(process), u, dt, stretch.doublings)
        row = truth.layout.complete(process)
        Phi_t, Q, d_t = truth.transitions(row, u[:, list(self.truth.inputs)], dt, self._doublings)
        a, n = truth.F.shape[0], plan.F.shape[0]
        A = np.zeros((len(dt), a + n + 1, a + n + 1))
        A[:, :a, :a], A[:, a:-1, a:-1], A[:, -1, -1] = Phi_t, ran, 1.0
        A[:, a:-1, :a] = after @ Phi_t - Phi_f @ before
        A[:, :a, -1], A[:, a:-1, -1] = d_t, np.einsum("kij,kj->ki", after, d_t) - d_f
        spread = np.zeros((len(dt), a + n + 1, a))
        spread[:, :a], spread[:, a:-1] = np.eye(a), after
        return A, spread, Q

    def _process_noise(self, stretch: Stretch, own: slice) -> FloatArray:
        """Q of each noise input of the truth, (K, noise inputs, truth states, truth states)."""
        truth, chunk = self.truth.plan, stretch.chunk
        dt, a = chunk.dt[own], truth.F.shape[0]
        row = truth.layout.complete(stretch.best_rows[0][own])
        if not self.truth.noises:
            return np.zeros((len(dt), 0, a, a))
        if not truth.time_invariant:
            return self._noises(row, dt)
        lengths, which = np.unique(dt, return_inverse=True)
        for length in lengths:
            if float(length) not in self._made:
                self._made[float(length)] = self._noises(row[:1], np.array([length]))[0]
        return np.stack([self._made[float(length)] for length in lengths])[which.ravel()]

    def _noises(self, row: FloatArray, dt: FloatArray) -> FloatArray:
        nothing = np.zeros((len(dt), len(self.truth.inputs)))
        alone = (replace(self.truth.plan, D=diffusion) for _, diffusion in self.truth.noises)
        return np.stack([one.transitions(row, nothing, dt, self._doublings)[1] for one in alone], axis=1)

    def _updated(self, stretch: Stretch, own: slice, K: FloatArray, M: FloatArray, end: FloatArray) -> FloatArray:
        """B (K, N, N) of the updates with the gains K (K, n, rows) of the filter."""
        plan = stretch.plan
        H_f, H_t = plan.design(plan.layout.complete(stretch.best_rows[1][own])), self.truth.design(end)
        a, n = M.shape[-1], M.shape[-2]
        B = np.broadcast_to(np.eye(a + n + 1), (len(K), a + n + 1, a + n + 1)).copy()
        B[:, a:-1, :a] = -K @ (H_t - H_f @ M)
        B[:, a:-1, a:-1] -= K @ plan.design(stretch.rows[1][own])
        return B

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
    """The gains (K, n, rows) of the updates that were made, zero for what was not fused; Phi, Q (K, n, n) as they were.

    Found anew from the covariances: where a prior is more than some 1e6 times as large as a noise, not to all digits.
    """
    plan, chunk = stretch.plan, stretch.chunk
    known = np.concatenate([stretch.covariance_before[None], stretch.result.covariance])[own.start : own.stop]
    P = np.where(chunk.restart[own][:, None, None], stretch.prior, known)
    if plan.separation is not None:
        P = plan.separation.covariance(P)
    P = Phi @ P @ np.swapaxes(Phi, -1, -2) + Q
    fused = stretch.usable[own].astype(float)
    H = plan.design(stretch.rows[1][own]) * fused[:, :, None]
    R = plan.noise(chunk.interval[own]) * fused[:, :, None] * fused[:, None, :]
    R[:, range(R.shape[-1]), range(R.shape[-1])] += 1.0 - fused
    if plan.separation is not None:
        return plan.separation.gain(P, H, R)[0]
    if plan.considered:
        return _gains_in_sequence(P, H, R, np.array(plan.considered))
    S = H @ P @ np.swapaxes(H, -1, -2) + R
    return np.swapaxes(np.linalg.solve(S, H @ P), -1, -2)


def _gains_in_sequence(P: FloatArray, H: FloatArray, R: FloatArray, considered: NDArray[np.bool_]) -> FloatArray:
    """The gains where some states get none: scalar after scalar, as they are fused; each changes what the next one finds."""
    rows = H.shape[-2]
    r, each = decorrelate(R, np.concatenate([H, np.broadcast_to(np.eye(rows), R.shape)], axis=-1))
    K = np.zeros(np.swapaxes(H, -1, -2).shape)
    for i in range(rows):
        h, own = each[..., i, : H.shape[-1]], each[..., i, H.shape[-1] :]
        Ph = np.einsum("...ij,...j->...i", P, h)
        s = np.einsum("...i,...i->...", h, Ph) + r[..., i]
        k = np.where(considered, 0.0, Ph / np.where(s > 0.0, s, np.inf)[..., None])
        A = P - k[..., :, None] * Ph[..., None, :]
        P = A - Ph[..., :, None] * k[..., None, :] + s[..., None, None] * k[..., :, None] * k[..., None, :]
        K = K + k[..., :, None] * (own - np.einsum("...i,...im->...m", h, K))[..., None, :]
    return K
