"""The price of suboptimal decentralised forms: what they claim, what their errors really are, what the optimal filter reaches.

The gains of the form (`estimfw.plan.separation`) act on the model as it is. Joint state ``[x; e; 1]``, x the true states and
e = x - x_hat the errors, Phi_f and H_f what the form has of Phi and H:

    predict   x <- Phi x + d + w,     e <- Phi_f e + (Phi - Phi_f) x + w
    update                            e <- (I - K H_f) e - K (H - H_f) x - K v

Form ``drop`` has Phi_f = Phi and H_f = H, so its errors do not depend on x.

Sources: Maybeck, Stochastic Models, Estimation and Control, vol. 1, section 6.8 (dual covariance analysis).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.estimators.stretch import Stretch
from estimfw.plan.separation import Form, Separation

__all__ = ["LinearStep", "Priced", "linear_steps", "priced"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LinearStep:
    """One step of a linear filter: x <- Phi x + d + w, cov w = Q; then y = H x + v, cov v = R.

    ``Phi``, ``Q`` (n, n), ``d`` (n,), ``H`` (m, n), ``R`` (m, m), m = 0 where nothing was fused. ``rows`` (m,) are the places of
    these rows among all rows of the plan; empty where nobody has to know.
    """

    Phi: FloatArray
    Q: FloatArray
    d: FloatArray
    H: FloatArray
    R: FloatArray
    rows: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Priced:
    """Sigmas (K, n) after the updates of each step.

    ``own``: what the form claims; ``true``: root mean square of its errors; ``optimal``: what the optimal filter reaches.
    """

    own: FloatArray
    true: FloatArray
    optimal: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """True to optimal, (K, n); 1 where both are zero."""
        exact = self.optimal <= 0.0
        return np.where(exact & (self.true <= 0.0), 1.0, self.true / np.where(exact, 1.0, self.optimal))


def linear_steps(stretch: Stretch) -> Iterator[LinearStep]:
    """The steps of a stretch of a run as they were, with the rows that were fused; a restart within it is not seen."""
    plan, chunk = stretch.plan, stretch.chunk
    Phi, Q, d = plan.transitions(stretch.rows[0], chunk.inputs, chunk.dt, stretch.doublings)
    H, R = plan.design(stretch.rows[1]), plan.noise(chunk.interval)
    for k, usable in enumerate(stretch.usable):
        rows = np.flatnonzero(usable)
        yield LinearStep(Phi[k], Q[k], d[k], H[k][rows], R[k][np.ix_(rows, rows)], tuple(rows.tolist()))


def priced(
    form: Form,
    groups: Sequence[Sequence[int]],
    steps: Iterable[LinearStep],
    prior_mean: FloatArray,
    prior: FloatArray,
    owners: Sequence[int] | None = None,
) -> Priced:
    """Run the form and the optimal filter side by side, without data.

    Parameters
    ----------
    form : 'drop' or 'decoupled'
    groups : sequence of sequences of int
        The states of each group; every state in exactly one.
    steps : iterable of LinearStep
        The optimal model, step by step; read once.
    prior_mean, prior : (n,) and (n, n) array
    owners : sequence of int, optional
        Group of each row of the plan, for steps that know their ``rows``; left out: the group whose states a row reads.

    Raises
    ------
    ConfigError
        A state in no group or in two; a row that reads states of two groups where ``owners`` is left out.
    """
    states = _group_of(groups, len(prior_mean))
    alone = Separation(form, states, ())
    own, optimal = alone.covariance(prior), prior
    true = _Drop(prior) if form == "drop" else _Decoupled(prior_mean, prior)
    kept = []
    for step in steps:
        apart = Separation(form, states, _rows(step, states, owners))
        Phi, Q = apart.transition(step.Phi, step.Q)
        own = apart.covariance(Phi @ own @ Phi.T + Q)
        K, S = apart.gain(own, step.H, step.R)
        own = apart.covariance(own - K @ S @ K.T)
        true.step(apart, step, K)
        optimal = _updated(step, step.Phi @ optimal @ step.Phi.T + step.Q)
        kept.append(np.sqrt(np.maximum([np.diag(own), np.diag(true.covariance), np.diag(optimal)], 0.0)))
    sigmas = np.stack(kept, axis=1) if kept else np.zeros((3, 0, len(prior_mean)))
    return Priced(sigmas[0], sigmas[1], sigmas[2])


def _group_of(groups: Sequence[Sequence[int]], n: int) -> tuple[int, ...]:
    """The group of each state."""
    found = [[g for g, group in enumerate(groups) if i in group] for i in range(n)]
    for i, of in enumerate(found):
        if len(of) != 1:
            many = "in no group" if not of else f"in {len(of)} groups"
            raise ConfigError(f"state {i} is {many}", hint="each state belongs to exactly one group")
    return tuple(of[0] for of in found)


def _rows(step: LinearStep, states: tuple[int, ...], owners: Sequence[int] | None) -> tuple[int, ...]:
    """The group of each row."""
    if owners is not None:
        return tuple(owners[row] for row in step.rows)
    made = []
    for place, h in enumerate(step.H):
        read = {states[i] for i in np.flatnonzero(h)}
        if len(read) > 1:
            which = step.rows[place] if step.rows else place
            raise ConfigError(
                f"row {which} of the measurements reads states of several groups",
                hint="say which group owns each row (owners)",
            )
        made.append(read.pop() if read else 0)
    return tuple(made)


def _updated(step: LinearStep, P: FloatArray) -> FloatArray:
    """The optimal covariance after the update, in Joseph's form."""
    S = step.H @ P @ step.H.T + step.R
    K = np.linalg.solve(S, step.H @ P).T
    A = np.eye(len(P)) - K @ step.H
    P = A @ P @ A.T + K @ step.R @ K.T
    return np.asarray(0.5 * (P + P.T))


class _Drop:
    """Errors of the form ``drop``: ``covariance`` (n, n)."""

    def __init__(self, prior: FloatArray) -> None:
        self.covariance = prior

    def step(self, apart: Separation, step: LinearStep, K: FloatArray) -> None:
        P = step.Phi @ self.covariance @ step.Phi.T + step.Q
        A = np.eye(len(P)) - K @ step.H
        P = A @ P @ A.T + K @ step.R @ K.T
        self.covariance = 0.5 * (P + P.T)


class _Decoupled:
    """Second moments of ``[x; e; 1]`` of the form ``decoupled``."""

    def __init__(self, mean: FloatArray, prior: FloatArray) -> None:
        n = len(mean)
        spread = np.vstack([np.eye(n), np.eye(n), np.zeros((1, n))])
        first = np.concatenate([mean, np.zeros(n), [1.0]])
        self._moments = spread @ prior @ spread.T + np.outer(first, first)
        self._n = n

    @property
    def covariance(self) -> FloatArray:
        own = slice(self._n, 2 * self._n)
        return self._moments[own, own]

    def step(self, apart: Separation, step: LinearStep, K: FloatArray) -> None:
        n, (Phi, _), H = self._n, apart.transition(step.Phi, step.Q), apart.design(step.H)
        A, B = np.eye(2 * n + 1), np.eye(2 * n + 1)
        A[:n, :n], A[:n, -1] = step.Phi, step.d
        A[n:-1, :n], A[n:-1, n:-1] = step.Phi - Phi, Phi
        B[n:-1, :n], B[n:-1, n:-1] = -K @ (step.H - H), np.eye(n) - K @ H
        J = A @ self._moments @ A.T
        J[:-1, :-1] += np.tile(step.Q, (2, 2))
        J = B @ J @ B.T
        J[n:-1, n:-1] += K @ step.R @ K.T
        self._moments = 0.5 * (J + J.T)
