"""What chance decides in each run: the start, drawn from the filter's prior before any policy, and what its source draws.

Run i of seed S draws from ``SeedSequence(S, spawn_key=(i,))``, which is ``SeedSequence(S).spawn(N)[i]`` for any N: a run is the
same whatever runs beside it. Its first child is for the start, its second for the source.

A source takes part in a Monte Carlo by one of::

    drawn_many(seeds, start) -> Draws
    drawn_many_for(plan, row, seeds, start) -> Draws        # one that has to know the plan

``seeds`` are R fresh SeedSequence, ``start`` maps the quantity of each block of the model before policies to what was drawn of
it, (R, all axes), in the frame in which the block was declared. `estimfw.data.draws.Draws.of` makes Draws of single records.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.draws import Draws
from estimfw.data.record import Record
from estimfw.errors import ConfigError, PluginError
from estimfw.kernels import ud
from estimfw.model.frame import rotation
from estimfw.registry.contract import broken, plugin_code
from estimfw.run.load import along_schedule, simulated
from estimfw.run.preprocess import preprocessed

__all__ = ["draw_runs", "drawn_record", "refuse_without_draws", "source_draws"]

FloatArray = NDArray[np.float64]


def draw_runs(problem: Problem, seed: int, runs: Sequence[int]) -> Draws:
    """The records of some runs, preprocessed; see `source_draws`."""
    made = source_draws(problem, seed, runs)
    return replace(made, record=preprocessed(problem, made.record))


def source_draws(problem: Problem, seed: int, runs: Sequence[int]) -> Draws:
    """The records of some runs, as the source makes them.

    Parameters
    ----------
    problem : Problem
    seed : int
    runs : sequence of int
        Which ones, from 0.

    Raises
    ------
    ConfigError
        The source draws nothing.
    """
    refuse_without_draws(problem)
    children = [np.random.SeedSequence(seed, spawn_key=(i,)).spawn(2) for i in runs]
    start = start_errors(problem, [of_start for of_start, _ in children])
    seeds = [of_source for _, of_source in children]
    owner = problem.owners.get("source")
    try:
        with plugin_code(owner, "drawn_many() of source"):
            if hasattr(problem.source, "drawn_many_for"):
                made = along_schedule(problem.source, problem).drawn_many_for(*simulated(problem), seeds, start)
            else:
                made = problem.source.drawn_many(seeds, start)
    except (ConfigError, PluginError) as error:
        problem.document.placed(error, ("source",))
        raise
    if not isinstance(made, Draws) or len(made) != len(seeds):
        raise broken(owner, "drawn_many() of source", f"did not make the Draws of {len(seeds)} runs")
    return made


def drawn_record(problem: Problem, seed: int, run: int) -> Record:
    """The record of one run, for `estimfw.run.run.run_problem`: to look at it closely."""
    return draw_runs(problem, seed, [run]).run(0)


def refuse_without_draws(problem: Problem) -> None:
    """ConfigError unless every source can draw."""
    if problem.source is None:
        raise ConfigError(
            "a Monte Carlo needs a source that simulates, and the config has none",
            location=problem.document.locate(()),
            hint="such as source: {kind: simulate_model, duration: 60 s, rate: 1 Hz}",
        )
    if problem.aiding:
        name = next(iter(problem.aiding))
        raise ConfigError(
            f"a Monte Carlo cannot draw aiding.{name}",
            location=problem.document.locate(("aiding", name)),
            hint="let the one source simulate all streams",
        )
    if not (hasattr(problem.source, "drawn_many") or hasattr(problem.source, "drawn_many_for")):
        kind = (problem.config.source or {}).get("kind", "of the config")
        raise ConfigError(
            f"source {kind} draws nothing at random: a Monte Carlo needs one that simulates",
            location=problem.document.locate(("source",)),
            hint="such as simulate_model, or sins_static.simulate; see estimfw.montecarlo.draw",
        )


def start_errors(problem: Problem, seeds: Sequence[np.random.SeedSequence]) -> dict[str, FloatArray]:
    """By quantity, states at the start (R, all axes) drawn from the prior of the model before policies."""
    model = problem.full
    mean, covariance = model.prior.evaluate(model.nominal(problem.reference))
    form = ud.factor(covariance)
    factor = (np.triu(form, 1) + np.eye(len(mean))) * np.sqrt(np.maximum(np.diag(form), 0.0))
    normal = np.stack([np.random.default_rng(seed).standard_normal(len(mean)) for seed in seeds])
    x = mean + np.einsum("ij,rj->ri", factor, normal)
    drawn: dict[str, FloatArray] = {}
    for block in model.blocks:
        if not block.quantity:
            continue
        full = np.zeros((len(seeds), len(block.all_axes)))
        at = model.offsets[block.name]
        full[:, block.live] = x[:, at : at + len(block.axes)]
        if block.frame is not None and block.home_frame is not None and block.frame != block.home_frame:
            turn = rotation(block.frame, block.home_frame, model.frame_map).evaluate(model.nominal(problem.reference))
            full = np.einsum("ij,rj->ri", turn, full)
        drawn[block.quantity] = full
    return drawn
