"""All runs of a Monte Carlo: parts of a fixed size, on as many processes as there are, in whatever order they get ready.

What a part is depends on the number of runs and the length of one, never on the number of workers; parts are put together in the
order of their runs. So the result is the same to the last bit.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError, UsageError
from estimfw.montecarlo.draw import drawn_record, refuse_without_draws
from estimfw.montecarlo.filtering import without_monitors
from estimfw.montecarlo.part import Honest, Part, Task, merged, run_part
from estimfw.montecarlo.parts_on_disk import PartFolder
from estimfw.montecarlo.quantities import quantities_of
from estimfw.run.dataset import result_dataset, versions
from estimfw.run.kernel_choice import LONG
from estimfw.run.needs_states import refuse_bank, refuse_without_states
from estimfw.run.run import covariance_steps, run_problem

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Campaign", "Workers", "chunk_of", "manifest_of", "run_campaign"]

Progress = Callable[[int, int], None]

#: Most runs of a part, and most steps of all of them: what a process holds in memory.
MOST_RUNS, MOST_STEPS = 128, 1 << 18
#: So many parts at least, where there are as many runs: for progress, and for more workers than one.
FEWEST_PARTS = 16


@dataclass(frozen=True, slots=True)
class Workers:
    """Processes on this machine, or the address of a dask scheduler."""

    processes: int = 1
    dask: str | None = None


@dataclass(frozen=True)
class Campaign:
    """All runs together: ``nominal`` is the result of the first run alone, ``part`` the numbers of all."""

    task: Task
    nominal: xr.Dataset
    part: Part
    chunk: int


def run_campaign(
    problem: Problem,
    seed: int,
    runs: int,
    workers: Workers = Workers(),
    chunk: int | None = None,
    folder: Path | None = None,
    progress: Progress | None = None,
    *,
    force: bool = False,
) -> Campaign:
    """Run a filter ``runs`` times.

    Parameters
    ----------
    problem : Problem
        Its source simulates; monitors do not act.
    seed : int
    runs : int, > 1
    workers : Workers
    chunk : int, optional
        Runs of a part, instead of `chunk_of`.
    folder : Path, optional
        Where finished parts are kept, and looked for; the caller removes it.
    progress : callable, optional
        Called with the runs done and the runs in all.
    force : bool
        Parts of another Monte Carlo in ``folder`` are dropped.

    Raises
    ------
    EstimfwError
        Of any kind; parts that are finished stay.
    """
    refuse_without_states(problem, "a Monte Carlo of consistency")
    refuse_bank(
        problem, "a Monte Carlo of consistency", "estimfw trial runs a bank over many draws, and tells its errors"
    )
    refuse_without_draws(problem)
    if runs < 2:
        raise UsageError("a Monte Carlo needs two runs at least", hint="several hundred tell something: --runs 400")
    problem = without_monitors(problem)
    task, nominal = _task(problem, seed, runs)
    size = chunk if chunk is not None else chunk_of(runs, task.time.size)
    ranges = [range(first, min(first + size, runs)) for first in range(0, runs, size)]
    store = PartFolder.opened(folder, manifest_of(problem, seed, runs, size), force=force) if folder else None
    parts: list[Part | None] = [store.read(i) if store else None for i in range(len(ranges))]
    done = sum(len(r) for r, part in zip(ranges, parts, strict=True) if part is not None)
    todo = [(i, ranges[i]) for i, part in enumerate(parts) if part is None]
    if progress is not None:
        progress(done, runs)
    for i, part in _computed(task, todo, workers):
        parts[i] = part
        if store is not None:
            store.write(i, part)
        done += len(ranges[i])
        if progress is not None:
            progress(done, runs)
    return Campaign(task, nominal, merged([part for part in parts if part is not None]), size)


def chunk_of(runs: int, steps: int) -> int:
    """Runs of a part, for so many runs of so many steps."""
    return max(1, min(MOST_RUNS, -(-runs // FEWEST_PARTS), MOST_STEPS // max(1, steps)))


def manifest_of(problem: Problem, seed: int, runs: int, chunk: int) -> dict[str, object]:
    """What the parts on disk belong to: all that decides their numbers."""
    text = json.dumps(problem.document.data, sort_keys=True)
    return {
        "config_sha256": hashlib.sha256(text.encode()).hexdigest(),
        "plan_hash": problem.plan.hash,
        "seed": seed,
        "runs": runs,
        "chunk": chunk,
        "versions": versions("numba"),
    }


def _task(problem: Problem, seed: int, runs: int) -> tuple[Task, xr.Dataset]:
    """The first run alone tells the timeline, what truth is known, and the honest covariance where there is one."""
    done = run_problem(problem, record=drawn_record(problem, seed, 0))
    nominal = result_dataset(done)
    steps = done.prepared.steps
    grid = covariance_steps(len(steps), problem.estimator.covariance_samples)
    error = done.estimate - done.truth if done.truth is not None else np.full(done.estimate.shape, np.nan)
    outputs = done.output_error if done.output_error is not None else np.full(done.output.shape, np.nan)
    known = np.all(np.isfinite(np.concatenate([error, outputs], axis=1)[grid]), axis=0)
    honest = None
    if "honest_covariance" in nominal:
        output = nominal["output_honest_sigma"].to_numpy()[grid] if "output_honest_sigma" in nominal else None
        none = np.zeros((grid.size, 0))
        honest = Honest(nominal["honest_covariance"].to_numpy(), none if output is None else output)
    quantities = quantities_of(problem, known)
    return Task(problem, seed, runs, steps.time, grid, quantities, honest), nominal


def _computed(task: Task, todo: list[tuple[int, range]], workers: Workers) -> Iterator[tuple[int, Part]]:
    """Parts as they get ready."""
    if not todo:
        return
    if workers.dask is None and min(workers.processes, len(todo)) == 1:
        for index, runs in todo:
            yield index, run_part(task, runs)
        return
    from joblib import Parallel, delayed, parallel_config

    _compile(task)
    with ExitStack() as stack:
        if workers.dask is not None:
            stack.enter_context(_dask_client(workers.dask))
            stack.enter_context(parallel_config(backend="dask"))
        else:
            stack.enter_context(parallel_config(backend="loky", n_jobs=workers.processes, inner_max_num_threads=1))
        run = Parallel(return_as="generator_unordered", pre_dispatch="2*n_jobs")
        yield from run(delayed(_numbered)(task, index, runs) for index, runs in todo)


def _numbered(task: Task, index: int, runs: range) -> tuple[int, Part]:
    return index, run_part(task, runs)


def _compile(task: Task) -> None:
    """Have the machine code in its cache before several processes want it at once."""
    problem = task.problem
    if problem.estimator.kernel != "numpy" and task.time.size * task.runs >= LONG:
        from estimfw.montecarlo.draw import draw_runs
        from estimfw.montecarlo.filtering import filter_runs

        filter_runs(problem, draw_runs(problem, task.seed, [0]), task.grid, task.runs, ["the first run"])


def _dask_client(address: str):  # type: ignore[no-untyped-def]
    try:
        from distributed import Client
    except ImportError:
        raise ConfigError(
            "--dask needs the packages dask and distributed, which are not installed",
            hint="pip install 'estimfw[dask]'; or leave it out and use --workers",
        ) from None
    try:
        return Client(address, timeout="10s")
    except (OSError, ValueError) as fault:
        raise UsageError(f"no dask scheduler answers at {address}: {fault}", hint="such as tcp://host:8786") from fault
