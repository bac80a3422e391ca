"""The conformance kit on sources that draw: ours pass, and what a careless one does is named."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.data.draws import Draws
from estimfw.testing import check_draws

SHORT = "source.duration=5 s"


@pytest.mark.parametrize("name", ["tracker", "thermal", "static_12"])
def test_our_sources_conform(example: Callable[..., Any], name: str) -> None:
    check_draws(example(name, SHORT))


@dataclass
class Careless:
    """A source with one generator for ever, or with a seed of its own."""

    good: Any
    mode: str
    rng: np.random.Generator

    def drawn_many(self, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, NDArray[np.float64]]) -> Draws:
        made: Draws = self.good.drawn_many(seeds, start)
        imu, runs = made.record.streams["imu"], len(seeds)
        if self.mode == "deaf":
            return Draws.of([self.good.load()] * runs)
        rng = self.rng if self.mode == "shared" else np.random.default_rng(1)
        values = rng.standard_normal(imu.values.shape)
        return replace(made, record=replace(made.record, streams={"imu": replace(imu, values=values)}))


@pytest.mark.parametrize(
    ("mode", "told"), [("shared", "more than its seed"), ("in order", "runs beside it"), ("deaf", "seeds are not used")]
)
def test_a_source_that_does_not_keep_to_its_seeds_is_named(example: Callable[..., Any], mode: str, told: str) -> None:
    problem = example("static_12", SHORT)
    careless = Careless(problem.source, mode, np.random.default_rng(0))
    with pytest.raises(AssertionError, match=told):
        check_draws(replace(problem, source=careless))
