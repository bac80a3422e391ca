"""Observability of a composed filter: at the frozen reference nominal, and along its record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimfw.analysis.along_record import AlongRecord, Watch
from estimfw.analysis.directions import Direction, StateNames, directions_of, unseen_rates
from estimfw.analysis.frozen import frozen_stretch
from estimfw.analysis.observability import Observability, piecewise_observability
from estimfw.analysis.removable import RemovableSets, least_determined, removable_sets, undriven
from estimfw.config.compose import Problem
from estimfw.policies.drop_states import expand
from estimfw.run.needs_states import refuse_bank, refuse_without_states
from estimfw.run.prepare import Prepared
from estimfw.run.run import Progress, covariance_steps, run_problem

__all__ = ["Observed", "default_protection", "observe"]

INSTANTS = 200
Names = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Observed:
    """What ``estimfw observe`` tells.

    Attributes
    ----------
    name : str
    names : StateNames
    time_invariant, reason : bool, str
    frozen : Observability
        At the reference nominal.
    directions : tuple of Direction
    rates : tuple of float
        Growth rates (1/s) of the modes in the unobservable directions.
    removable, all_removable : RemovableSets
        Without protected states; and with them.
    protected : tuple of str
    chosen : tuple of str or None
    prior_sigma : tuple of float
        SI.
    record : AlongRecord or None
    record_left_out : str
        Why there is nothing along the record; empty where there is.
    record_directions : tuple of Direction
        What the Gramian of a time-varying plan hardly sees.
    """

    name: str
    names: StateNames
    time_invariant: bool
    reason: str
    frozen: Observability
    directions: tuple[Direction, ...]
    rates: tuple[float, ...]
    removable: RemovableSets
    all_removable: RemovableSets
    protected: Names
    chosen: Names | None
    prior_sigma: tuple[float, ...]
    record: AlongRecord | None
    record_left_out: str
    record_directions: tuple[Direction, ...]

    @property
    def hit(self) -> tuple[Names, ...]:
        """Sets that are minimal too, but hold protected states."""
        own = set(self.protected)
        return tuple(s for s in map(self.labels, self.all_removable.sets) if own & set(s))

    def labels(self, chosen: Sequence[int]) -> Names:
        return tuple(self.names.states[i] for i in chosen)


def observe(
    problem: Problem,
    *,
    protect: Sequence[str] | None = None,
    segments: int = 10,
    record: bool = True,
    progress: Progress | None = None,
) -> Observed:
    """Analyse a filter.

    Parameters
    ----------
    problem : Problem
    protect : sequence of str, optional
        States or blocks that are not to be removed, instead of `default_protection`.
    segments : int
        Pieces into which the record is cut.
    record : bool
        Run the filter over its record, where it has a source and one model all along (no stages).
    progress : callable, optional
        See `run_problem`.

    Raises
    ------
    EstimfwError
        Of any kind.
    """
    refuse_without_states(problem, "observability")
    left_out = _left_out(problem, record)
    if not left_out:
        refuse_bank(problem, "observability along the record", "--no-record tells what is the same for all members")
    model, reference = problem.model, problem.reference
    frozen, prior = frozen_stretch(model, reference), model.prior.evaluate(reference)[1]
    found, names = piecewise_observability([frozen], prior), StateNames.of(model)
    protected = expand(model, protect) if protect is not None else default_protection(problem)
    driven = ~undriven([frozen])
    guarded = [s in protected for s in model.states]
    removable = removable_sets(found, [frozen], prior, guarded)
    chosen = least_determined(removable.sets, found.degree)
    along = _along(problem, found, segments, progress) if not left_out else None
    varying = along is not None and not problem.plan.time_invariant
    return Observed(
        name=str(problem.config.name),
        names=names,
        time_invariant=problem.plan.time_invariant,
        reason=problem.plan.reason,
        frozen=found,
        directions=tuple(directions_of(found, prior, names, driven)),
        rates=tuple(float(r) for r in unseen_rates(found, frozen.F)),
        removable=removable,
        all_removable=removable_sets(found, [frozen], prior, [False] * len(guarded)) if any(guarded) else removable,
        protected=tuple(protected),
        chosen=None if chosen is None else tuple(model.states[i] for i in chosen),
        prior_sigma=tuple(np.sqrt(np.diag(prior)).tolist()),
        record=along,
        record_left_out=left_out,
        record_directions=tuple(directions_of(along.seen, prior, names, driven)) if along and varying else (),
    )


def default_protection(problem: Problem) -> Names:
    """States that correct the nominal, and states that outputs read."""
    plan, n = problem.plan, len(problem.plan.states)
    read = {entry % n for _, jacobian in plan.outputs for entry, _, _ in jacobian.monomials}
    return tuple(s for i, s in enumerate(plan.states) if plan.corrected[i] or i in read)


def _left_out(problem: Problem, record: bool) -> str:
    """Why nothing is told along the record; empty where it is."""
    if not record:
        return "--no-record"
    if problem.source is None:
        return "the config has no source"
    if problem.plan.stages:
        return "the filter has stages, and along the record what is estimated changes from one to the next"
    return ""


def _along(problem: Problem, found: Observability, segments: int, progress: Progress | None) -> AlongRecord:
    made: list[Watch] = []

    def watch(prepared: Prepared) -> list[Watch]:
        steps = prepared.steps
        instants = covariance_steps(len(steps), INSTANTS)
        made.append(Watch(steps.time, steps.dt, steps.restart, prepared.prior[1], segments, instants))
        return made

    run_problem(problem, progress, watch=watch)
    return made[0].tell(kernel=found.kernel if problem.plan.time_invariant else None)
