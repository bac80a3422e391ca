"""What is kept of a part of the runs: moments over the runs at the instants of a grid, and a few numbers of each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.moments import Moments
from estimfw.config.compose import Problem
from estimfw.data.draws import Draws
from estimfw.data.record import SAME
from estimfw.estimators.scan import ChunkResult
from estimfw.montecarlo.draw import draw_runs
from estimfw.montecarlo.filtering import Filtered, filter_runs
from estimfw.montecarlo.quantities import Quantity, inverses, squares
from estimfw.run.outputs import output_values, state_truth, wrapped

__all__ = ["Honest", "Part", "Task", "errors_at", "merged", "run_part"]

FloatArray = NDArray[np.float64]
Part = dict[str, FloatArray]


@dataclass(frozen=True, slots=True)
class Honest:
    """What a reduced filter's errors really scatter by: covariance (G, n, n) of the states, sigma (G, outputs)."""

    covariance: FloatArray
    output_sigma: FloatArray


@dataclass(frozen=True, slots=True)
class Task:
    """What all parts of a Monte Carlo have in common.

    ``time`` (K,) s are the ends of all steps, ``grid`` (G,) those that are kept.
    """

    problem: Problem
    seed: int
    runs: int
    time: FloatArray
    grid: NDArray[np.int64]
    quantities: tuple[Quantity, ...]
    honest: Honest | None


def run_part(task: Task, runs: Sequence[int]) -> Part:
    """Draw, filter, and square the errors of some runs; `merged` puts parts together.

    Returns
    -------
    dict of str to array
        ``mean``/``deviation`` of ``error``, ``variance`` (own) over the runs (G, columns) and of ``squares``,
        ``honest_squares`` (G, quantities); ``nis_total``, ``nis_freedom`` (G, measurements), each between an instant of the
        grid and the one before; of each run ``run_squares``, ``end_squares`` and their honest ones (R, quantities) (mean over
        the grid, and its last instant), ``end_error``, ``end_variance`` (R, columns), ``run_nis``, ``run_nis_freedom``
        (R, measurements), ``run_due`` and ``run_gated`` (R, measurements).
    """
    draws = draw_runs(task.problem, task.seed, runs)
    done = filter_runs(task.problem, draws, task.grid, task.runs, [f"run {i} of seed {task.seed}" for i in runs])
    error, variance = errors_at(task.problem, draws, done, task.time[task.grid])
    own = np.stack([squares(error[..., q.columns], _own(task, q, done, variance)) for q in task.quantities], axis=-1)
    part = {"count": np.array([float(len(runs))])}
    part |= _over_runs("error", error) | _over_runs("variance", variance) | _of_squares("", own)
    if task.honest is not None:
        part |= _of_squares("honest_", _honest(task, task.honest, error))
    part |= {"end_error": error[:, -1], "end_variance": variance[:, -1]}
    return part | _nis(done, task.grid)


def merged(parts: Sequence[Part]) -> Part:
    """All parts in the order of their runs."""
    counts = [int(p["count"][0]) for p in parts]
    whole = {"count": np.array([float(sum(counts))])}
    for name in parts[0]:
        if name.endswith("_mean"):
            stem = name.removesuffix("_mean")
            total = Moments.merge(
                Moments(c, p[name], p[f"{stem}_deviation"]) for c, p in zip(counts, parts, strict=True)
            )
            whole |= {name: total.mean, f"{stem}_deviation": total.deviation}
        elif name in ("nis_total", "nis_freedom"):
            whole[name] = np.sum([p[name] for p in parts], axis=0)
        elif name != "count" and not name.endswith("_deviation"):
            whole[name] = np.concatenate([p[name] for p in parts])
    return whole


def errors_at(problem: Problem, draws: Draws, done: Filtered, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Errors of states and outputs, and their own variances, both (R, G, columns); NaN where the truth is not known."""
    runs, instants = done.estimate.shape[:2]
    rows = done.rows.reshape(runs * instants, -1)
    truth = _truth(draws, runs, time)
    flat = _flat_result(done)
    states = state_truth(problem, rows, truth)
    error, variance = [flat.estimate - states], [np.einsum("kii->ki", flat.covariance)]
    for output, jacobian in problem.plan.outputs:
        value, sigma = output_values(problem, output, jacobian, flat, rows)
        true = np.asarray(output.truth(truth), dtype=float) if output.truth is not None and truth else np.nan
        error.append(wrapped(value - true, output.period))
        variance.append(np.square(sigma))
    return tuple(np.concatenate(x, axis=1).reshape(runs, instants, -1) for x in (error, variance))  # type: ignore[return-value]


def _truth(draws: Draws, runs: int, time: FloatArray) -> Mapping[str, FloatArray]:
    """The truth at these instants (nearest sample) of all runs, (R G, ...)."""
    if draws.truth is None:
        return {}
    index = np.clip(np.searchsorted(draws.time, time - SAME), 0, draws.time.size - 1)
    made = {}
    for name, value in draws.truth.items():
        at = value[:, index] if value.shape[1] > 1 else value
        shape = (runs, time.size, *value.shape[2:])
        made[name] = np.broadcast_to(at, shape).reshape(runs * time.size, *value.shape[2:])
    return made


def _flat_result(done: Filtered) -> ChunkResult:
    runs, instants, n = done.estimate.shape
    none = np.zeros((0, 0))
    nothing = np.zeros((0, 0), dtype=np.int64)
    return ChunkResult(
        estimate=done.estimate.reshape(runs * instants, n),
        covariance=done.covariance.reshape(runs * instants, n, n),
        rows=none, provider=none, innovation=none, sigma=none, nis=none, disposition=nothing, used=nothing, log_det=none,
    )  # fmt: skip


def _own(task: Task, q: Quantity, done: Filtered, variance: FloatArray) -> FloatArray:
    if q.kind == "output":
        return inverses(variance[..., q.columns, None])
    return inverses(done.covariance[..., np.array(q.columns)[:, None], np.array(q.columns)])


def _honest(task: Task, honest: Honest, error: FloatArray) -> FloatArray:
    n, made = honest.covariance.shape[-1], []
    for q in task.quantities:
        if q.kind == "output":
            P = np.square(honest.output_sigma[:, [c - n for c in q.columns]])[..., None]
        else:
            P = honest.covariance[:, np.array(q.columns)[:, None], np.array(q.columns)]
        made.append(squares(error[..., q.columns], inverses(P[None])))
    return np.stack(made, axis=-1)


def _over_runs(name: str, values: FloatArray) -> Part:
    total = Moments.of(values)
    return {f"{name}_mean": total.mean, f"{name}_deviation": total.deviation}


def _of_squares(prefix: str, values: FloatArray) -> Part:
    """``values`` (R, G, quantities); NaN at instants at which there is nothing to judge, as of a state that is held."""
    known = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        mean = np.where(known, values, 0.0).sum(axis=1) / known.sum(axis=1)
    over_time = {f"{prefix}run_squares": mean, f"{prefix}end_squares": values[:, -1]}
    return _over_runs(f"{prefix}squares", values) | over_time


def _nis(done: Filtered, grid: NDArray[np.int64]) -> Part:
    total, freedom = np.where(done.freedom > 0, done.nis, 0.0), done.freedom.astype(float)
    edges = np.concatenate([[0], grid[:-1] + 1])
    return {
        "nis_total": np.add.reduceat(total.sum(axis=0), edges, axis=0),
        "nis_freedom": np.add.reduceat(freedom.sum(axis=0), edges, axis=0),
        "run_nis": total.sum(axis=1),
        "run_nis_freedom": freedom.sum(axis=1),
        "run_due": done.due.astype(float),
        "run_gated": done.gated.astype(float),
    }
