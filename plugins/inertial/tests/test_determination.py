"""The mechanization alone: a determination, whose provider runs in the compiled scan of a filter without states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from estimfw_inertial.strapdown import Strapdown
from numpy.typing import NDArray

from estimfw.config.compose import compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import read_document
from estimfw.config.types import Settings, Site
from estimfw.model.parts import Output
from estimfw.registry.component import Component
from estimfw.registry.load import load_plugins
from estimfw.run.load import load_record
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]


class StandingConfig(Settings):
    kind: Literal["standing"]


def leaning(estimates: Mapping[str, FloatArray], nominal: Mapping[str, FloatArray]) -> FloatArray:
    return nominal["C_bn"][..., 2, :2]


class Standing(Strapdown):
    """The mechanization, with the lean of its axes as an output."""

    outputs = (Output("lean", ("R", "F"), ("1", "1"), ("1", "1"), leaning, (), ("C_bn",)),)


STANDING = """\
estimfw: 1
site: {latitude: 34 deg}
nominal: {kind: standing}
initial_attitude: {kind: inertial.given, yaw: 22 deg, pitch: 1 deg, roll: -1 deg}
estimator: {kind: determination}
source:
  {kind: sins_static.simulate, duration: 60 s, rate: 10 Hz, sway: {amplitude: [1 deg, 2 deg, 3 deg], period: 4 s}}
"""


def standing(cfg: StandingConfig, site: Site | None) -> Standing:
    assert site is not None
    return Standing(site.latitude, site.longitude, site.height, 1)


def test_the_compiled_provider_runs_in_the_compiled_scan() -> None:
    own = Component("nominal", "standing", StandingConfig, standing, "strapdown")
    made = compose(read_document(STANDING), load_plugins([*core_components(), own]))
    record = load_record(made)
    plain, compiled = (
        run_problem(replace(made, estimator=made.estimator.model_copy(update={"kernel": kernel})), record=record)
        for kernel in ("numpy", "numba")
    )
    assert (plain.prepared.scan.name, compiled.prepared.scan.name) == ("numpy", "numba")
    assert np.ptp(plain.output[:, 0]) > 1e-3
    np.testing.assert_allclose(compiled.output, plain.output, rtol=1e-12, atol=1e-14)
