"""The error budget of a filter: what each source contributes to the errors of its outputs and states, along a run."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.dual_covariance import DualCovariance
from estimfw.analysis.error_sources import Source, all_sources, single_sources
from estimfw.config.compose import Problem
from estimfw.config.truth import Truth, truth_of
from estimfw.estimators.stretch import Stretch, Watcher
from estimfw.run.honest import output_moments, truth_start
from estimfw.run.needs_states import refuse_bank, refuse_without_states
from estimfw.run.prepare import Prepared
from estimfw.run.run import Collected, Progress, covariance_steps, run_problem
from estimfw.units.unit_text import parse_unit

__all__ = ["Budget", "BudgetSource", "error_budget"]

FloatArray = NDArray[np.float64]

#: Share of the mean square error below which a source is not worth naming.
LEAST = 1e-6


@dataclass(frozen=True, slots=True)
class BudgetSource:
    """``kind`` is ``initial error``, ``removed state``, ``process noise``, ``measurement noise`` or ``known values``."""

    kind: str
    name: str


@dataclass(frozen=True)
class Budget:
    """Contributions to the root mean square error, by source.

    Attributes
    ----------
    name, truth_name : str
        Of the filter, and of the model that its errors are measured with.
    absent : tuple of str
        States of the filter's own unreduced model that the truth does not have: they are zero in it.
    time : (T,) array, s
    quantities : tuple of str
        Outputs, then states.
    units : tuple of str
        In which people read each.
    scales : (quantities,) array
        From SI to that unit.
    outputs : int
        How many of the quantities are outputs.
    sources : tuple of BudgetSource
    contributions : (T, sources, quantities) array, SI
        Their squares add up to that of ``total``.
    total, own : (T, quantities) array, SI
        Honest sigma, found apart from the contributions; and the filter's own.
    """

    name: str
    truth_name: str
    absent: tuple[str, ...]
    time: FloatArray
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    scales: FloatArray
    outputs: int
    sources: tuple[BudgetSource, ...]
    contributions: FloatArray
    total: FloatArray
    own: FloatArray

    @cached_property
    def shares(self) -> FloatArray:
        """Parts of the mean square error, (T, sources, quantities); zero where there is no error."""
        square = self.total[:, None, :] ** 2
        return np.divide(self.contributions**2, square, out=np.zeros_like(self.contributions), where=square > 0.0)

    def largest(self, quantity: int, count: int = 3) -> tuple[int, ...]:
        """The sources that contribute most at the end, the largest first; those with hardly a share are none."""
        share = self.shares[-1, :, quantity]
        return tuple(int(i) for i in np.argsort(-share, kind="stable")[:count] if share[i] > LEAST)


def error_budget(problem: Problem, real: Problem | None = None, progress: Progress | None = None) -> Budget:
    """Run a filter over its record and tell apart what its errors come from.

    Parameters
    ----------
    problem : Problem
    real : Problem, optional
        Whose model, before its policies, is the truth instead of the filter's own unreduced one; states are matched by label.
    progress : callable, optional
        See `run_problem`.

    Raises
    ------
    EstimfwError
        Of any kind; ConfigError where the two models do not fit together.
    """
    refuse_without_states(problem, "an error budget")
    refuse_bank(problem, "an error budget", "look at the member that wins: estimator: {kind: kalman}, and its start")
    truth = truth_of(
        problem.full, problem.changes, problem.provider, problem.settings.computed, problem.reference, problem.plan,
        real.full if real is not None else None,
    )  # fmt: skip
    seen: list[_Apart] = []

    def watch(prepared: Prepared) -> list[Watcher]:
        seen.append(_Apart(prepared, truth))
        return list(seen)

    done = run_problem(problem, progress, watch=watch)
    return seen[0].budget(done, str((real or problem).config.name))


class _Apart:
    """Watches a run; keeps what the result keeps whole covariances of."""

    def __init__(self, prepared: Prepared, truth: Truth) -> None:
        start = truth_start(prepared, truth)
        begin = (start.mean, start.covariance, start.map, prepared.prior[0])
        self._single = single_sources(truth.plan, prepared.plan, *begin)
        self._dual = DualCovariance(truth.plan, (*all_sources(*begin), *self._single), prepared.state.row)
        self._seen = _seen(start.map, np.sqrt(np.diag(start.covariance)))
        self._truth, self._at, self._parts = truth, 0, list[FloatArray]()
        self._wanted = covariance_steps(len(prepared.steps), prepared.problem.estimator.covariance_samples)

    def __call__(self, stretch: Stretch) -> None:
        inside = self._wanted[(self._wanted >= self._at) & (self._wanted < self._at + len(stretch))] - self._at
        for joint in self._dual.advance(stretch, inside):
            squares = np.concatenate([output_moments(self._truth, stretch, joint), joint.states()], axis=2)
            self._parts.append(np.sqrt(np.maximum(squares, 0.0)))
        self._at += len(stretch)

    def budget(self, done: Collected, truth_name: str) -> Budget:
        problem, found = done.prepared.problem, np.concatenate(self._parts)
        blocks, outputs = problem.model.blocks, [o for o, _ in problem.plan.outputs]
        units = [u for o in outputs for u in o.units] + [b.unit for b in blocks for _ in b.axes]
        shown = [u for o in outputs for u in o.display_units] + [
            b.display_unit or b.unit for b in blocks for _ in b.axes
        ]
        labels = [label for o in outputs for label in o.labels]
        return Budget(
            name=str(problem.config.name),
            truth_name=truth_name,
            absent=self._truth.model.absent,
            time=done.prepared.steps.time[self._wanted],
            quantities=(*labels, *problem.plan.states),
            units=tuple(shown),
            scales=np.array(
                [float(parse_unit(u).scale) / float(parse_unit(d).scale) for u, d in zip(units, shown, strict=True)]
            ),
            outputs=len(labels),
            sources=tuple(BudgetSource(self._kind(s), s.name) for s in self._single),
            contributions=found[:, 1:],
            total=found[:, 0],
            own=np.concatenate([done.output_sigma, done.sigma], axis=1)[self._wanted],
        )

    def _kind(self, source: Source) -> str:
        states = self._truth.model.model.states
        mine = [states.index(name) for name in source.name.split(" + ")] if source.kind == "initial error" else []
        return "removed state" if mine and np.all(self._seen[mine] < 0.5) else source.kind


def _seen(map: FloatArray, sigma: FloatArray) -> FloatArray:
    """Which part (a,) of the variance of each truth state the states of the filter can stand for."""
    scaled = map * np.where(sigma > 0.0, sigma, 1.0)
    length = np.linalg.norm(scaled, axis=1, keepdims=True)
    scaled = scaled / np.where(length > 0.0, length, 1.0)
    return np.asarray(np.diag(np.linalg.pinv(scaled, rcond=1e-9) @ scaled))
