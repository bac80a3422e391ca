"""The filter over many runs at once: one timeline, one plan, a leading axis over the runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.draws import Draws
from estimfw.data.record import Record
from estimfw.errors import DataError, NumericalError
from estimfw.estimators.many_runs import scan_runs
from estimfw.estimators.scan import ChunkResult, FilterState, SubSteps, refuse_lost
from estimfw.kernels import joseph, ud
from estimfw.kernels.fuse import GATED
from estimfw.model.nominal import InitialNominal
from estimfw.registry.contract import plugin_code
from estimfw.run.found_start import with_found_covariance
from estimfw.run.kernel_choice import Scan, chosen_scan
from estimfw.run.prepare import Prepared, make_chunk, prepare
from estimfw.run.staging import StagedFilter, stage_chunks

__all__ = ["Filtered", "filter_runs", "set_aside", "without_monitors"]

FloatArray = NDArray[np.float64]

#: Numbers in the covariances of all runs of a stretch of steps (64 MiB).
STRETCH_NUMBERS = 1 << 23
LONGEST_STRETCH = 4096


@dataclass(frozen=True, slots=True)
class Filtered:
    """R runs over K steps, of which G make the grid.

    Attributes
    ----------
    estimate : (R, G, n) array
    covariance : (R, G, n, n) array
    rows : (R, G, size) array
        The nominal at the end of the step, with its derived variables.
    nis : (R, K, measurements) array
        NaN where nothing was measured; of a gated one too.
    freedom : (R, K, measurements) array
        Components behind each NIS, 0 where there is none.
    due, gated : (R, measurements) array
        How often each measurement was due, and how often a gate refused it.
    """

    estimate: FloatArray
    covariance: FloatArray
    rows: FloatArray
    nis: FloatArray
    freedom: NDArray[np.int64]
    due: NDArray[np.int64]
    gated: NDArray[np.int64]


def set_aside(problem: Problem) -> tuple[str, ...]:
    """What of the config `without_monitors` leaves out, a sentence each, for people."""
    told = []
    if problem.monitors:
        told.append("monitors do not act over many runs")
    if problem.estimator.smoother is not None:
        told.append("the smoother does not act over many runs: all figures are those of the filter")
    return tuple(told)


def without_monitors(problem: Problem) -> Problem:
    """Monitors and health do not act in a Monte Carlo: they could end or restart runs apart. Nor does a smoother."""
    if problem.estimator.smoother is not None:
        problem = replace(problem, estimator=problem.estimator.model_copy(update={"smoother": None}))
    health = problem.config.health
    if not problem.monitors and health is None:
        return problem
    told = health.told_only() if health is not None else None
    config = problem.config.model_copy(update={"monitors": {}, "health": told})
    return replace(problem, monitors=(), config=config)


def filter_runs(
    problem: Problem, draws: Draws, grid: NDArray[np.int64], runs_in_all: int, names: Sequence[str]
) -> Filtered:
    """Run the filter over some draws.

    Parameters
    ----------
    problem : Problem
    draws : Draws
        Of R runs.
    grid : (G,) array of int
        The steps that are kept.
    runs_in_all : int
        Of the Monte Carlo; with the steps it decides for the NumPy or the compiled kernel, the same for all parts.
    names : sequence of R str
        For the message about a run that fails.

    Raises
    ------
    NumericalError
        A run left the numbers; with its name.
    """
    prepared = prepare(problem, draws.run(0))
    whole = replace(prepared, record=draws.record)
    filters, states = _begun(problem, prepared, draws, runs_in_all)
    kept: list[tuple[ChunkResult, ChunkResult]] = []
    length = _stretch(len(draws), len(problem.plan.states))
    for first, last, stage in stage_chunks(prepared.plan, prepared.steps, length):
        if stage is not None:
            states = [one.enter(stage, state)[0] for one, state in zip(filters, states, strict=True)]
        chunk = make_chunk(whole, first, last)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            states, result = scan_runs([one.scan for one in filters], states, chunk)
        _refuse_lost(prepared, result, first, names)
        inside = grid[(grid >= first) & (grid < last)] - first
        light = replace(result, covariance=np.zeros((0, 0, 0)), rows=np.zeros((0, 0)), provider=np.zeros((0, 0)))
        kept.append((_at(result, inside), light))
    return _joined(problem, kept)


def _stretch(runs: int, states: int) -> int:
    return max(1, min(LONGEST_STRETCH, STRETCH_NUMBERS // max(1, runs * states * states)))


def _at(result: ChunkResult, steps: NDArray[np.int64]) -> ChunkResult:
    return replace(
        result,
        estimate=result.estimate[:, steps],
        covariance=result.covariance[:, steps],
        rows=result.rows[:, steps],
    )


def _joined(problem: Problem, kept: list[tuple[ChunkResult, ChunkResult]]) -> Filtered:
    def joined(name: str, which: int) -> FloatArray:
        return np.concatenate([getattr(two[which], name) for two in kept], axis=1)

    disposition = joined("disposition", 1)
    innovation, nis, at, freedom = joined("innovation", 1), joined("nis", 1), 0, []
    for m in problem.plan.measurements:
        freedom.append(np.isfinite(innovation[..., at : at + m.rows]).sum(axis=-1))
        at += m.rows
    counted = np.stack(freedom, axis=-1) if freedom else np.zeros(nis.shape, dtype=np.int64)
    return Filtered(
        estimate=joined("estimate", 0),
        covariance=joined("covariance", 0),
        rows=problem.plan.layout.complete(joined("rows", 0)),
        nis=nis,
        freedom=np.where(np.isfinite(nis), counted, 0),
        due=(disposition >= 0).sum(axis=1),
        gated=(disposition == GATED).sum(axis=1),
    )


def _begun(
    problem: Problem, prepared: Prepared, draws: Draws, runs_in_all: int
) -> tuple[list[StagedFilter], list[FilterState]]:
    """For each run its recursion, bound to its start, and its first state."""
    starts = [_start(problem, draws.run(i)) for i in range(len(draws))]
    if any(start.time != prepared.start.time for start in starts):
        raise DataError(
            "the runs of a Monte Carlo begin at different instants",
            hint="let the start be found in a stretch of a given length",
        )
    plan, bound, count = problem.plan, prepared.bound, len(draws)
    whole = replace(_together(starts), time=prepared.steps.start)
    if bound is not None:
        rows = np.broadcast_to(bound.initial_row(whole), (count, plan.layout.provided))
        providers = np.broadcast_to(bound.initial_state(whole), (count, bound.n_state))
    else:
        rows = np.broadcast_to(plan.layout.pack(problem.reference), (count, plan.layout.provided))
        providers = np.zeros((count, 0))
    nominal = plan.layout.unpack(plan.layout.complete(rows))
    mean, covariance = plan.prior.evaluate(nominal)
    n = len(plan.states)
    means, covariances = np.broadcast_to(mean, (count, n)), np.broadcast_to(covariance, (count, n, n)).copy()
    for i, start in enumerate(starts):
        if start.covariance:
            own = {name: value[i] for name, value in nominal.items()}
            covariances[i] = with_found_covariance(problem.model, covariances[i], start, own)
    kernel = ud if problem.estimator.covariance == "ud" else joseph
    forms = kernel.factor(covariances)
    first = chosen_scan(problem, bound, rows[0], (means[0], covariances[0]), len(prepared.steps) * runs_in_all)
    scans = [first.begun(sub, means[i], forms[i]) for i, sub in enumerate(_sub_steps(problem, first, rows))]
    for scan in scans:
        for dt in np.unique(prepared.steps.dt):
            scan.doublings(float(dt))
    filters = [StagedFilter(problem, scan, covariances[i]) for i, scan in enumerate(scans)]
    return filters, [FilterState(means[i].copy(), forms[i], providers[i], rows[i]) for i in range(count)]


def _sub_steps(problem: Problem, first: Scan, rows: FloatArray) -> list[SubSteps]:
    """Of each run; one for all where they begin with the same dynamics."""
    plan = problem.plan
    F = plan.F.evaluate(plan.layout.complete(rows))
    if np.all(F[:1] == F):
        return [first.doublings] * len(rows)
    return [SubSteps(plan, row) for row in rows]


def _start(problem: Problem, record: Record) -> InitialNominal:
    with plugin_code(problem.owners.get("initial_attitude"), "find() of 'initial_attitude'"):
        given = problem.initial.find(record) if problem.initial is not None else None
    with plugin_code(problem.owners.get("nominal"), "start() of 'nominal'"):
        return problem.provider.start(given, record)


def _together(starts: Sequence[InitialNominal]) -> InitialNominal:
    """The values of all starts with a leading axis."""
    first = starts[0]
    return replace(
        first, values={name: np.stack([np.asarray(s.values[name]) for s in starts]) for name in first.values}
    )


def _refuse_lost(prepared: Prepared, result: ChunkResult, first: int, names: Sequence[str]) -> None:
    variance = np.einsum("rkii->rki", result.covariance)
    good = np.isfinite(result.estimate) & np.isfinite(variance) & (variance >= -1e-30)
    count = result.estimate.shape[1]
    for run in np.flatnonzero(~np.all(good, axis=(1, 2))).tolist():
        own = replace(result, estimate=result.estimate[run], covariance=result.covariance[run])
        try:
            refuse_lost(prepared.plan, own, first, prepared.steps.time[first : first + count])
        except NumericalError as error:
            error.message = f"{names[run]}: {error.message}"
            raise
