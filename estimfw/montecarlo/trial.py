"""Several filters over the same draws: run after run, each filter on the same record."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import SAME
from estimfw.errors import ConfigError, UsageError
from estimfw.montecarlo.draw import refuse_without_draws, source_draws
from estimfw.montecarlo.filtering import set_aside, without_monitors
from estimfw.registry.registry import Registry
from estimfw.run.contenders import Contender, refuse_other_records
from estimfw.run.preprocess import preprocessed
from estimfw.run.run import Collected, run_problem
from estimfw.units.unit_text import parse_unit

__all__ = ["Trial", "run_trial"]

FloatArray = NDArray[np.float64]

INSTANTS = 300


@dataclass(frozen=True)
class Trial:
    """Errors of F filters over R runs.

    Attributes
    ----------
    title : str
    names : tuple of F str
    seed : int
    time : (T,) array, s
    quantities, units : tuple of Q str
        Outputs that all filters have (states, where there are no outputs), and the unit in which people read each.
    scales : (Q,) array
        From SI to that unit.
    error : (F, R, T, Q) array, SI
        NaN before a filter begins.
    set_aside : tuple of str
        What of the configs does not act over many runs, and of which filter.
    """

    title: str
    names: tuple[str, ...]
    seed: int
    time: FloatArray
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    scales: FloatArray
    error: FloatArray
    set_aside: tuple[str, ...] = ()

    @property
    def runs(self) -> int:
        return int(self.error.shape[1])

    def at(self, time: float) -> int:
        """Index of an instant.

        Raises
        ------
        UsageError
            It lies outside the runs.
        """
        if not self.time[0] - SAME <= time <= self.time[-1] + SAME:
            raise UsageError(
                f"{time:.10g} s lies outside the runs",
                hint=f"they go from {self.time[0]:.10g} to {self.time[-1]:.10g} s",
            )
        return int(np.argmin(np.abs(self.time - time)))

    def quantity(self, label: str) -> int:
        """Index of an output; UsageError with those that there are."""
        if label not in self.quantities:
            raise UsageError(f"no filter of these all has {label!r}", hint=f"there are {', '.join(self.quantities)}")
        return self.quantities.index(label)

    def filter(self, name: str) -> int:
        """Index of a filter; UsageError with those that there are."""
        if name not in self.names:
            raise UsageError(f"no filter here is called {name!r}", hint=f"there are {', '.join(self.names)}")
        return self.names.index(name)


def run_trial(
    contenders: Sequence[Contender],
    registry: Registry,
    runs: int,
    seed: int,
    workers: int = 1,
    times: Sequence[float] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Trial:
    """Draw and filter.

    Parameters
    ----------
    contenders : sequence of F Contender
        The first one's source draws each run for all of them; the sources have to be the same.
    registry : Registry
    runs : int
    seed : int
        Run i draws from its i-th child: the same draws as in a Monte Carlo of one of the filters.
    workers : int
        Processes; no number depends on it.
    times : sequence of float, s
        Instants that are kept besides an even grid.
    progress : callable, optional
        Called with runs done and runs in all.

    Raises
    ------
    EstimfwError
        A config is refused, draws nothing, or brings a record of its own; a time lies outside.
    """
    composed = [one.compose(registry) for one in contenders]
    problems = tuple(without_monitors(one) for one in composed)
    refuse_other_records(contenders, problems)
    refuse_without_draws(problems[0])
    first = list(_runs(problems, seed, 0))
    time = _grid(first, times)
    shared = _shared(contenders, first)
    found: list[FloatArray] = [np.zeros(0)] * runs
    for done, (run, errors) in enumerate(_computed(problems, seed, runs, workers, time, shared), start=1):
        found[run] = errors
        if progress is not None:
            progress(done, runs)
    units, scales = _units(first[0], shared)
    return Trial(
        title=str(problems[0].config.name),
        names=tuple(one.name for one in contenders),
        seed=seed,
        time=time,
        quantities=shared,
        units=units,
        scales=scales,
        error=np.stack(found, axis=1),
        set_aside=tuple(
            f"{one.name}: {told}" for one, whole in zip(contenders, composed, strict=True) for told in set_aside(whole)
        ),
    )


def _computed(
    problems: tuple[Problem, ...], seed: int, runs: int, workers: int, time: FloatArray, shared: tuple[str, ...]
) -> Iterator[tuple[int, FloatArray]]:
    """Runs as they get ready."""
    if min(workers, runs) == 1:
        yield from (_one(problems, seed, run, time, shared) for run in range(runs))
        return
    from joblib import Parallel, delayed, parallel_config

    with parallel_config(backend="loky", n_jobs=workers, inner_max_num_threads=1):
        pool = Parallel(return_as="generator_unordered", pre_dispatch="2*n_jobs")
        yield from pool(delayed(_one)(problems, seed, run, time, shared) for run in range(runs))


def _one(
    problems: tuple[Problem, ...], seed: int, run: int, time: FloatArray, shared: tuple[str, ...]
) -> tuple[int, FloatArray]:
    """Errors (F, T, Q) of all filters in one run."""
    return run, np.stack([_errors(done, time, shared) for done in _runs(problems, seed, run)])


def _runs(problems: Sequence[Problem], seed: int, run: int) -> Iterator[Collected]:
    """Each filter on one draw of the first one's source, with the preprocessing of its own config."""
    drawn = source_draws(problems[0], seed, [run])
    for problem in problems:
        own = replace(drawn, record=preprocessed(problem, drawn.record))
        yield run_problem(problem, record=own.run(0))


def _errors(done: Collected, time: FloatArray, shared: tuple[str, ...]) -> FloatArray:
    labels, error = _known(done)
    own = done.prepared.steps.time
    index = np.clip(np.searchsorted(own, time + SAME) - 1, 0, own.size - 1)
    values = error[index][:, [labels.index(label) for label in shared]]
    return np.where((time < own[0] - SAME)[:, None], np.nan, values)


def _known(done: Collected) -> tuple[list[str], FloatArray]:
    """Outputs and their errors; those of the states where there are no outputs."""
    plan = done.prepared.plan
    if done.output_error is not None and done.output_error.shape[1]:
        return [label for o, _ in plan.outputs for label in o.labels], done.output_error
    truth = done.truth if done.truth is not None else np.full(done.estimate.shape, np.nan)
    return list(plan.states), done.estimate - truth


def _shared(contenders: Sequence[Contender], first: Sequence[Collected]) -> tuple[str, ...]:
    known = [_known(done) for done in first]
    labels = [
        label
        for i, label in enumerate(known[0][0])
        if all(label in other for other, _ in known) and np.isfinite(known[0][1][-1, i])
    ]
    if not labels:
        raise ConfigError(
            f"{', '.join(c.name for c in contenders)} have no output in common whose truth is known",
            hint="a source that simulates tells the truth",
        )
    return tuple(labels)


def _units(done: Collected, shared: tuple[str, ...]) -> tuple[tuple[str, ...], FloatArray]:
    plan, blocks = done.prepared.plan, done.prepared.problem.model.blocks
    units = {
        label: (u, d) for o, _ in plan.outputs for label, u, d in zip(o.labels, o.units, o.display_units, strict=True)
    }
    units |= {s: (b.unit, b.display_unit or b.unit) for b in blocks for s in b.labels if s not in units}
    scales = [float(parse_unit(units[s][0]).scale) / float(parse_unit(units[s][1]).scale) for s in shared]
    return tuple(units[s][1] for s in shared), np.array(scales)


def _grid(first: Sequence[Collected], times: Sequence[float]) -> FloatArray:
    """Instants that all filters reach, and those that are asked for."""
    own = first[0].prepared.steps.time
    last = min(float(done.prepared.steps.time[-1]) for done in first)
    own = own[own <= last + SAME]
    for at in times:
        if not own[0] - SAME <= at <= last + SAME:
            raise UsageError(
                f"--at {at:.10g} s lies outside the runs", hint=f"they go from {own[0]:.10g} to {last:.10g} s"
            )
    chosen = np.unique(np.linspace(0, own.size - 1, min(own.size, INSTANTS)).round().astype(np.int64))
    return np.unique(np.concatenate([own[chosen], np.asarray(times, dtype=float)]))
