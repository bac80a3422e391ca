"""Which recursion runs: the estimator's; of a Kalman filter NumPy for short work, compiled for long, or as the config says."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem, filter_path
from estimfw.config.generic.decentralised import DecentralisedConfig
from estimfw.config.generic.unscented import UnscentedConfig
from estimfw.data.record import Event
from estimfw.errors import ConfigError
from estimfw.estimators.decentralised.exchange import InProcessExchange, Silence
from estimfw.estimators.decentralised.scan import DecentralisedScan
from estimfw.estimators.numpy_scan import NumpyScan
from estimfw.estimators.scan import Chunk, ChunkResult, FilterSettings, FilterState, SubSteps
from estimfw.estimators.unscented_scan import UnscentedScan
from estimfw.model.nominal import BoundProvider
from estimfw.plan.completion import derived_in_loop
from estimfw.plan.plan import Plan
from estimfw.plan.stages import Stage

__all__ = ["Scan", "chosen_scan", "slow_kernel_events"]

FloatArray = NDArray[np.float64]

#: From this many steps on the compiled kernel is quicker end to end: it takes about half a second to load, a step in NumPy
#: half a millisecond and more.
LONG = 1_000


class Scan(Protocol):
    """A recursion bound to plan, provider and start."""

    name: str
    doublings: SubSteps
    plan: Plan

    def begun(self, doublings: SubSteps, mean: FloatArray, form: FloatArray) -> Scan: ...

    def in_stage(self, stage: Stage) -> Scan: ...

    def run(self, state: FilterState, chunk: Chunk) -> tuple[FilterState, ChunkResult]: ...


def chosen_scan(
    problem: Problem,
    bound: BoundProvider | None,
    row: FloatArray,
    prior: tuple[FloatArray, FloatArray],
    steps: int,
) -> Scan:
    """The recursion for so many steps.

    Parameters
    ----------
    problem : Problem
    bound : BoundProvider or None
    row : (provided,) array
        The nominal at the start.
    prior : (n,) and (n, n) array
    steps : int

    Raises
    ------
    ConfigError
        ``kernel: numba``, and something in the loop has no compiled form.
    """
    if isinstance(problem.estimator, UnscentedConfig):
        return UnscentedScan(
            problem.plan, bound, problem.estimator.loop == "closed", problem.estimator.spread, row, prior
        )
    if isinstance(problem.estimator, DecentralisedConfig):
        loop, exchange = problem.estimator.loop, _exchange(problem.estimator)
        return DecentralisedScan(problem.plan, bound, loop == "closed", exchange, row, prior)
    settings = FilterSettings(
        problem.estimator.covariance, problem.estimator.loop == "closed", moves=problem.estimator.smoother is not None
    )
    wanted, reason = problem.estimator.kernel, _plain_python(problem.plan, bound)
    if wanted == "numba" and reason:
        raise ConfigError(
            f"kernel: numba cannot run this model: {reason}",
            location=problem.document.locate((*filter_path(problem.document), "kernel")),
            hint="use kernel: auto",
        )
    if wanted == "numba" or (wanted == "auto" and not reason and steps >= LONG):
        from estimfw.estimators.numba_scan import NumbaScan

        return NumbaScan(problem.plan, bound, settings, row, prior)
    return NumpyScan(problem.plan, bound, settings, row, prior)


def _exchange(cfg: DecentralisedConfig) -> InProcessExchange:
    names = [node.name for node in cfg.nodes]
    silences = [Silence(names.index(one.node), one.begin, one.until) for one in cfg.exchange.silent]
    return InProcessExchange(names, silences)


def slow_kernel_events(problem: Problem, bound: BoundProvider | None, steps: int) -> tuple[Event, ...]:
    """That long work runs in plain Python because a plugin brings no compiled form."""
    reason = _plain_python(problem.plan, bound)
    if not reason or steps < LONG or problem.estimator.kernel != "auto":
        return ()
    return (Event(float("nan"), "kernel", "not compiled", f"{reason}; the NumPy kernel runs, which is slower"),)


def _plain_python(plan: Plan, bound: BoundProvider | None) -> str:
    """What in the loop has no compiled form; empty if all has."""
    if bound is not None and bound.compiled is None:
        return "the nominal provider has no compiled step"
    names = sorted(d.name for d in derived_in_loop(plan) if d.compiled is None)
    return f"the derived variable {names[0]} is plain Python" if names else ""
