"""Small Monte Carlos, and a truth that is not the one the filter believes in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.draws import Draws
from estimfw.montecarlo.campaign import run_campaign
from estimfw.montecarlo.dataset import campaign_dataset


@dataclass(frozen=True)
class TruthOf:
    """A source, as a plugin would bring it: what the simulation of another model makes."""

    other: Problem

    def load(self) -> None:
        raise AssertionError("a Monte Carlo draws")

    def drawn_many(self, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, NDArray[np.float64]]) -> Draws:
        plan = self.other.plan
        row = plan.layout.complete(plan.layout.pack(self.other.reference))
        made = self.other.source.drawn_many_for(plan, row, seeds, start)
        return Draws.of([made.run(i) for i in range(len(seeds))])


@pytest.fixture(scope="session")
def tracked(example: Callable[..., Problem]) -> Callable[..., Problem]:
    """A short tracker with these overrides, on the truth of the example."""

    def make(*overrides: str) -> Problem:
        short = ("source.duration=30 s", "estimator.gate=null", "estimator.covariance_samples=20")
        truth, believed = example("tracker", *short), example("tracker", *short, *overrides)
        return replace(believed, source=TruthOf(truth))

    return make


@pytest.fixture(scope="session")
def judged_runs() -> Callable[..., xr.Dataset]:
    """The result of so many runs."""

    def make(problem: Problem, runs: int, seed: int = 1, confidence: float = 0.95) -> xr.Dataset:
        return campaign_dataset(run_campaign(problem, seed, runs), confidence)

    return make
