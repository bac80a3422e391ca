"""Run a prepared filter over its record, chunk by chunk."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from estimfw.config.compose import Problem
from estimfw.data.memory import refuse_too_large
from estimfw.data.record import Event, Record
from estimfw.errors import PluginError
from estimfw.estimators.bank import Judged, judge, reported
from estimfw.estimators.scan import Chunk, ChunkResult, FilterState, refuse_lost
from estimfw.estimators.stretch import Stretch, Watcher
from estimfw.plan.plan import Plan
from estimfw.plan.stages import stage_of_steps
from estimfw.run.collected import Collected, Piece, Timing, collected, piece
from estimfw.run.honest import HonestSigma, of_reported
from estimfw.run.load import load_record
from estimfw.run.prepare import Prepared, make_chunk, prepare
from estimfw.run.recovery import Recovery, acts
from estimfw.run.smoothing import chosen_smoothing
from estimfw.run.staging import StagedFilter

__all__ = ["Collected", "Timing", "run_problem"]

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]

#: A chunk has at most so many steps, and so many numbers in its covariances (64 MiB).
LONGEST_CHUNK = 4096
#: After something was done about the run's health, which may soon be due again; each chunk is twice as long as the one before.
SHORT_CHUNK = 64
CHUNK_NUMBERS = 1 << 23
#: For a smoother there are so many matrices a step instead of one.
MOVES = 8


def run_problem(
    problem: Problem,
    progress: Progress | None = None,
    record: Record | None = None,
    watch: Callable[[Prepared], Sequence[Watcher]] | None = None,
) -> Collected:
    """Load, prepare, run.

    Parameters
    ----------
    problem : Problem
    progress : callable, optional
        Called with steps done and steps in all, after each chunk.
    record : Record, optional
        Instead of the one that the config's source makes; preprocessed already.
    watch : callable, optional
        Makes, of the prepared run, what shall see each stretch of it.

    Raises
    ------
    EstimfwError
        Of any kind; nothing is written.
    """
    begin = time.perf_counter()
    record = record if record is not None else load_record(problem)
    loaded = time.perf_counter()
    prepared = prepare(problem, record)
    _refuse_too_long(prepared)
    ready = time.perf_counter()
    wanted = covariance_steps(len(prepared.steps), problem.estimator.covariance_samples)
    members = prepared.members
    honest = [HonestSigma(one, problem.truth, wanted) for one in members] if problem.truth is not None else []
    smoothing = chosen_smoothing(prepared, wanted)
    watchers: list[list[Watcher]] = [list(watch(one)) if watch is not None else [] for one in members]
    for i, seeing in enumerate(watchers):
        seeing += honest[i : i + 1]
        seeing += [smoothing] if smoothing is not None else []
    with threadpool_limits(1, user_api="blas"):  # matrices are small: threads only wait for each other
        pieces, filtering, recovered = _scan(prepared, progress, wanted, watchers)
        smoothed = smoothing.smoothed() if smoothing is not None else None
    timing = Timing(loaded - begin, ready - loaded, filtering, smoothed.seconds if smoothed is not None else 0.0)
    done = replace(collected(prepared, pieces, wanted, timing, recovered), smoothed=smoothed)
    return _with_honest(done, honest, np.concatenate([p.best for p in pieces])) if honest else done


def _with_honest(done: Collected, honest: Sequence[HonestSigma], best: NDArray[np.int64]) -> Collected:
    """With the honest sigmas of the reported members, ``best`` (K,), or why there are none."""
    final = honest[int(best[-1])]
    if final.lost:
        told = Event(float("nan"), "truth model", "no honest sigma", final.lost)
        return replace(done, events=(*done.events, told))
    return replace(done, honest=of_reported(honest, best, done.covariance_index))


@dataclass(frozen=True, slots=True)
class _Ran:
    """One chunk after the filter, of all members: where it ended, what came out, who is best, what is reported; s spent."""

    states: list[FilterState]
    results: list[ChunkResult]
    judged: Judged
    result: ChunkResult
    spent: float


def _scan(
    prepared: Prepared, progress: Progress | None, wanted: NDArray[np.int64], watchers: Sequence[Sequence[Watcher]]
) -> tuple[list[Piece], float, tuple[Event, ...]]:
    """Chunk by chunk, all members over each; ``watchers`` are those of each member.

    Where the health of the run asks for something, a chunk ends at the step at which it is due; and none goes beyond a stage.
    """
    steps, members, pieces, spent = prepared.steps, prepared.members, list[Piece](), 0.0
    kept = MOVES if prepared.problem.estimator.smoother is not None else 1
    longest = length = chunk_length(len(prepared.plan.states), kept * len(members))
    states, covariances = [one.state for one in members], [one.prior[1] for one in members]
    filters = [StagedFilter(one.problem, one.scan, one.prior[1]) for one in members]
    score, first, stage = np.zeros(len(members)), 0, stage_of_steps(prepared.plan.stages, steps.begin)
    recovery = Recovery(prepared.problem) if acts(prepared.problem) else None
    while first < len(steps):
        last = min(first + length, int(np.searchsorted(stage, stage[first], side="right")))
        if prepared.plan.stages and (first == 0 or stage[first] != stage[first - 1]):
            entered = [one.enter(int(stage[first]), state) for one, state in zip(filters, states, strict=True)]
            states, covariances = [state for state, _ in entered], [covariance for _, covariance in entered]
        chunk, ran = _run_chunk(prepared, filters, states, score, first, last, recovery)
        spent += ran.spent
        act = recovery.due(steps.time[first:last], ran.result) if recovery is not None else None
        if act is not None and first + act.steps < last:
            last = first + act.steps
            chunk, ran = _run_chunk(prepared, filters, states, score, first, last, recovery)
            spent += ran.spent
        own_time = steps.time[first:last]
        refuse_lost(prepared.plan, ran.result, first, own_time)
        score = ran.judged.score[-1]
        with _told_when(first, last, steps.time):
            pieces.append(piece(prepared, ran.result, ran.judged, first, last, wanted))
            for i in np.flatnonzero(np.isfinite(score)).tolist():
                stretch = _stretch(
                    members[i], filters[i].plan, chunk, ran.results[i], states[i], covariances[i], own_time
                )
                for see in watchers[i]:
                    see(stretch)
        states, covariances = ran.states, [each.covariance[-1] for each in ran.results]
        length = min(longest, 2 * length)
        if recovery is not None:
            recovery.restart = False
            if act is not None:
                states, covariances = recovery.acted(members, states, covariances, act, float(own_time[-1]))
                length = min(longest, SHORT_CHUNK)
        first = last
        if progress is not None:
            progress(last, len(steps))
    return pieces, spent, tuple(recovery.events) if recovery is not None else ()


def _run_chunk(
    prepared: Prepared, filters: Sequence[StagedFilter], states: list[FilterState], score: FloatArray, first: int, last: int,
    recovery: Recovery | None,
) -> tuple[Chunk, _Ran]:  # fmt: skip
    chunk = make_chunk(prepared, first, last)
    if recovery is not None and recovery.restart:
        chunk = replace(chunk, restart=np.append(True, chunk.restart[1:]))
    begin = time.perf_counter()
    with _told_when(first, last, prepared.steps.time), np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        done = [one.scan.run(state, chunk) for one, state in zip(filters, states, strict=True)]
        results = [result for _, result in done]
        judged = judge(prepared.plan, results, score, scored=prepared.problem.kind == "bank")
        result = reported(results, judged.best)
    return chunk, _Ran([state for state, _ in done], results, judged, result, time.perf_counter() - begin)


def _stretch(
    prepared: Prepared,
    plan: Plan,
    chunk: Chunk,
    result: ChunkResult,
    before: FilterState,
    covariance: FloatArray,
    time: FloatArray,
) -> Stretch:
    return Stretch(
        plan=plan,
        provider=prepared.bound,
        chunk=chunk,
        result=result,
        before=before,
        covariance_before=covariance,
        prior_mean=prepared.prior[0],
        prior=prepared.prior[1],
        time=time,
        doublings=prepared.scan.doublings,
        closed_loop=prepared.problem.estimator.loop == "closed",
    )


@contextmanager
def _told_when(first: int, last: int, time: FloatArray) -> Iterator[None]:
    """A plugin's fault is told with the stretch of the run in which it came."""
    try:
        yield
    except PluginError as error:
        if " t = " not in error.message:
            error.message += f" (steps {first + 1} to {last}, t = {time[first]:g} to {time[last - 1]:g} s)"
        raise


def _refuse_too_long(prepared: Prepared) -> None:
    """ConfigError where the result does not fit into memory."""
    plan, steps = prepared.plan, len(prepared.steps)
    n, outputs = len(plan.states), sum(len(o.components) for o, _ in plan.outputs)
    rows = sum(m.rows for m in plan.measurements)
    smoothed = 2 * n + 2 * outputs if prepared.problem.estimator.smoother is not None else 0
    numbers = 4 * n + 4 * outputs + 3 * rows + 7 * len(plan.measurements) + len(prepared.members) + smoothed
    text = f"the results of {steps} steps of {n} states"
    refuse_too_large(2.0 * 8.0 * steps * numbers, text, "shorten the record, or run it in parts")


def chunk_length(states: int, members: int = 1) -> int:
    """Steps that are run at once: memory stays bounded however many states and members of a bank there are."""
    return max(1, min(LONGEST_CHUNK, CHUNK_NUMBERS // max(1, members * states * states)))


def covariance_steps(count: int, samples: int) -> NDArray[np.int64]:
    """Steps at which the whole covariance is kept: evenly spread, the last one always."""
    return np.unique(np.linspace(0, count - 1, min(count, samples)).round().astype(np.int64))
