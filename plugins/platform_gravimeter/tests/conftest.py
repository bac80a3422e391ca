"""The examples of the gravimeter, opened, and the sigmas along their runs in the units of the paper."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.run.from_python import open_filter
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]
Sigmas = Callable[..., FloatArray]

EXAMPLES = Path(__file__).parents[3] / "examples"
ARCMIN, MICRO_G, DEGREE_PER_HOUR = np.pi / 10800.0, 9.80665e-6, np.pi / 180.0 / 3600.0
#: SI of one of the units m/s, arcmin, ug, deg/h, state by state.
UNITS = np.repeat([1.0, ARCMIN, MICRO_G, DEGREE_PER_HOUR], [2, 3, 2, 3])


@pytest.fixture(scope="session")
def opened() -> Open:
    """``opened("gravimeter", "nominal.alpha=0 deg")``."""
    return lambda name, *overrides: open_filter(EXAMPLES / f"{name}.yaml", overrides)


@pytest.fixture(scope="session")
def sigmas(opened: Open) -> Sigmas:
    """``sigmas("gravimeter", ...)``: sigma (1200, 10) after the update of each second, in m/s, arcmin, ug, deg/h."""

    def run(name: str, *overrides: str) -> FloatArray:
        done = run_problem(opened(name, *overrides))
        assert np.array_equal(done.prepared.steps.time, np.arange(1.0, 1201.0))
        return np.asarray(done.sigma / UNITS)

    return run
