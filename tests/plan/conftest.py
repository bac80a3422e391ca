"""A small model over a nominal with constant, stepped and varying variables, and its plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from estimfw.model.build import build_model
from estimfw.model.coefficient import constant, identity, matrix, scalar, vector
from estimfw.model.frame import Frame
from estimfw.model.model import Model
from estimfw.model.nominal import CorrectionSlot, NominalVariable
from estimfw.model.parts import (
    BlockParts,
    DerivedVariable,
    Measurement,
    MeasurementTerm,
    NoiseInput,
    ProcessParts,
    ProcessTerm,
    StateBlock,
)
from estimfw.plan.discretisation import Discretisation
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import Plan, make_plan

FRAMES = (Frame("n", ("E", "N", "U")), Frame("b", ("R", "F", "U"), parent="n", rotation="C_bn", rate="omega_nb_n"))


def speed_of(velocity_n: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(velocity_n, axis=-1))


LAYOUT = NominalLayout(
    (
        NominalVariable("C_bn", (3, 3), "1", "varying"),
        NominalVariable("velocity_n", (3,), "m/s", "varying"),
        NominalVariable("gravity", (), "m/s^2", "constant"),
        NominalVariable("heading_step", (), "rad", "stepped"),
    ),
    (DerivedVariable("speed", (), ("velocity_n",), speed_of),),
)


def triad(name: str, frame: str, quantity: str = "") -> BlockParts:
    axes = next(f.axes for f in FRAMES if f.name == frame)
    block = StateBlock(name, axes, axes, "1", frame=frame, home_frame=frame, quantity=quantity)
    return BlockParts(block, tuple(map(tuple, np.eye(3).tolist())), (0.0,) * 3, frames=FRAMES)


@pytest.fixture
def layout() -> NominalLayout:
    return LAYOUT


@pytest.fixture
def model() -> Callable[..., Model]:
    """``model(terms=[...], psd=...)``: v, phi in n, a in b; z = v, with the nominal's velocity as innovation."""

    def make(
        terms: Sequence[ProcessTerm] = (),
        psd: Sequence[float] = (1.0, 1.0, 1.0),
        H: str = "constant",
        sigma: float = 0.1,
    ) -> Model:
        axes = FRAMES[1].axes
        own = (
            ProcessTerm("tilt", "v", "phi", scalar("gravity") * identity(3), "n"),
            ProcessTerm("drive", "v", "w", identity(3), "n"),
        )
        reads = {"constant": identity(3), "varying": matrix("C_bn")}[H]
        z = Measurement(
            "z", ("E", "N", "U"), ("E", "N", "U"), "m/s", (MeasurementTerm("v", reads),),
            tuple(map(tuple, (sigma**2 * np.eye(3)).tolist())), "per_measurement", frame="n",
            innovation=vector("velocity_n"), sign=-1.0,
        )  # fmt: skip
        noise = NoiseInput("w", axes, axes, tuple(psd), "m/s^2", frame="b")
        blocks = [triad("v", "n", "velocity"), triad("phi", "n", "attitude"), triad("a", "b")]
        built = build_model(blocks, [ProcessParts((*own, *terms), (noise,))], [z])
        return built.with_parts(derived=LAYOUT.derived)

    return make


@pytest.fixture
def plan() -> Callable[..., Plan]:
    """``plan(model)``."""

    def make(model: Model, gate: float | None = None, discretisation: Discretisation | None = None) -> Plan:
        slots = (CorrectionSlot("velocity", "n"), CorrectionSlot("attitude", "n"))
        return make_plan(model, LAYOUT, slots, discretisation or Discretisation(), {"z": gate})

    return make


@pytest.fixture
def decay() -> ProcessTerm:
    return ProcessTerm("decay", "a", "a", constant(-0.1 * np.eye(3)), "b")
