"""Problems from the examples, and what they come to, in the units of the tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import load_document
from estimfw.registry.load import load_plugins
from estimfw.run.run import Collected, run_problem

FloatArray = NDArray[np.float64]
EXAMPLES = Path(__file__).parents[3] / "examples"
ARCMIN, DEG_H, MICRO_G = np.pi / 10800.0, np.pi / 180.0 / 3600.0, 9.80665e-6
#: The unit in which the tables of the specification have states of an SI unit.
TABLED = {"rad": ARCMIN, "rad/s": DEG_H, "m/s^2": MICRO_G, "m/s": 1.0}
#: Section 4 followed to the letter: the coefficients along the way of constant velocity, errors by the model itself, no noise.
LETTER = ("source.truth=linear", "source.noise=false", "estimator.loop=open")
HEADING = "measurements.heading={kind: ins_errors.heading, noise: 6 arcmin}"


@dataclass(frozen=True)
class Done:
    """A run, its states in the units of the tables."""

    problem: Problem
    run: Collected

    @property
    def units(self) -> FloatArray:
        return np.array([TABLED[unit] for unit in self.problem.plan.units])

    def step(self, time: float) -> int:
        """The step that ends at ``time`` s."""
        return int(np.argmin(np.abs(self.run.prepared.steps.time - time)))

    def sigma(self, time: float) -> FloatArray:
        """At ``time`` s; at 0 that of the prior."""
        if time == 0.0:
            return np.asarray(np.sqrt(np.diag(self.run.prepared.prior[1])) / self.units)
        return np.asarray(self.run.sigma[self.step(time)] / self.units)

    @property
    def end_error(self) -> FloatArray:
        """x - xhat at the end."""
        assert self.run.truth is not None
        return np.asarray((self.run.truth[-1] - self.run.estimate[-1]) / self.units)


Open = Callable[..., Problem]
Run = Callable[..., Done]


@pytest.fixture(scope="session")
def opened() -> Open:
    """``opened("ins_gm9", "source.seed=3")``."""
    registry = load_plugins(core_components())
    return lambda name, *overrides: compose(load_document(EXAMPLES / f"{name}.yaml", overrides), registry)


@pytest.fixture(scope="session")
def done(opened: Open) -> Run:
    """The same, run; each once."""

    @lru_cache
    def make(name: str, *overrides: str) -> Done:
        problem = opened(name, *overrides)
        return Done(problem, run_problem(problem))

    return make
