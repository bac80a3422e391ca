"""Drives that the tests share: perfect ones, with the exact speed beside the increments."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import pytest
from estimfw_sins_odometer.simulate import SimulateConfig, Simulation
from estimfw_sins_odometer.vehicle import Vehicle

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import load_document
from estimfw.config.types import Site
from estimfw.data.record import Record
from estimfw.registry.load import load_plugins

EXAMPLES = Path(__file__).parents[3] / "examples"
PLACE = {"latitude": "34.25 deg", "longitude": "108.9 deg", "height": "400 m"}

#: One start instead of a bank; its heading is to be said too.
ONE = ("estimator={kind: kalman, covariance: joseph, loop: closed}", "initial_attitude.headings=1")

Drive = Callable[..., Record]
Open = Callable[..., Problem]


@pytest.fixture(scope="session")
def site() -> Site:
    return Site.model_validate(PLACE)


@pytest.fixture(scope="session")
def vehicle(site: Site) -> Vehicle:
    return Vehicle(site.latitude, site.height, 100)


@pytest.fixture(scope="session")
def drive(site: Site) -> Drive:
    """``drive(seed=..., duration=..., ...)``: a record; perfect sensors and the exact speed unless said otherwise."""

    @lru_cache(maxsize=4)
    def made(**settings: object) -> Record:
        base = {"kind": "sins_odometer.simulate", "errors": False, "speed": "exact"}
        return Simulation(SimulateConfig.model_validate({**base, **settings}), site).load()

    return made


@pytest.fixture(scope="session")
def opened() -> Open:
    """``opened("odometer_aeba.yaml", *overrides)``."""

    def made(name: str, *overrides: str) -> Problem:
        return compose(load_document(str(EXAMPLES / name), list(overrides)), load_plugins(core_components()))

    return made


@pytest.fixture(scope="session")
def one_start(opened: Open) -> Open:
    """The example of the estimation from one start, level and heading North unless an override says otherwise."""

    def made(*overrides: str) -> Problem:
        return opened("odometer_aeba.yaml", *ONE, *overrides)

    return made
