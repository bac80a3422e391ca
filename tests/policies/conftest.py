"""A 12-state inertial error model built from the framework's parts alone, and a tilted reference nominal."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.model.build import build_model
from estimfw.model.coefficient import identity, skew
from estimfw.model.frame import Frame
from estimfw.model.model import Model
from estimfw.model.parts import (
    BlockParts,
    Measurement,
    MeasurementTerm,
    NoiseInput,
    ProcessParts,
    ProcessTerm,
    StateBlock,
)

FloatArray = NDArray[np.float64]
FRAMES = (
    Frame("n", ("E", "N", "U")),
    Frame("b", ("R", "F", "U"), parent="n", rotation="C_bn", rate="omega_nb_n"),
    Frame("s", ("x", "y", "z"), parent="b", rotation="C_sb", rate="omega_bs_b"),
)
AXES = {f.name: f.axes for f in FRAMES}
SIGMA = {"v": 0.1, "phi": 0.17, "a": 1e-3, "e": 5e-8}


def diagonal(values: Sequence[float]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(x) for x in row) for row in np.diag(values))


def triad(name: str, frame: str, sigma: Sequence[float]) -> BlockParts:
    block = StateBlock(name, AXES[frame], AXES[frame], "1", frame=frame, home_frame=frame, quantity=name)
    return BlockParts(block, diagonal(np.square(sigma).tolist()), (0.0,) * 3, frames=FRAMES)


def white(name: str, psd: Sequence[float]) -> NoiseInput:
    return NoiseInput(name, AXES["b"], AXES["b"], tuple(psd), "1", frame="b")


TERMS = (
    ProcessTerm("coriolis", "v", "v", -2.0 * skew("earth_rate_n"), "n"),
    ProcessTerm("gravity_tilt", "v", "phi", skew("f_n"), "n"),
    ProcessTerm("accel_bias_coupling", "v", "a", identity(3), "n"),
    ProcessTerm("accel_noise_coupling", "v", "wa", identity(3), "n"),
    ProcessTerm("earth_rate", "phi", "phi", -skew("earth_rate_n"), "n"),
    ProcessTerm("gyro_bias_coupling", "phi", "e", -identity(3), "n"),
    ProcessTerm("gyro_noise_coupling", "phi", "we", -identity(3), "n"),
)


@pytest.fixture
def reference() -> dict[str, FloatArray]:
    """A base that stands tilted at 34 deg north; ``s`` is a sensor housing in it."""
    rate = 7.292115e-5 * np.array([0.0, np.cos(np.radians(34.0)), np.sin(np.radians(34.0))])
    return {
        "C_bn": Rotation.from_euler("ZXY", [40.0, 20.0, -30.0], degrees=True).as_matrix(),
        "C_sb": Rotation.from_euler("ZXY", [-10.0, 5.0, 70.0], degrees=True).as_matrix(),
        "omega_nb_n": np.zeros(3),
        "omega_bs_b": np.zeros(3),
        "f_n": np.array([0.0, 0.0, 9.8]),
        "gravity": np.array(9.8),
        "earth_rate_n": rate,
    }


@pytest.fixture
def inertial() -> Callable[..., Model]:
    """``inertial(gyro_psd=(1, 2, 3), bias_sigma=...)``: v, phi in n; a, e in b; z = v in n."""

    def make(
        accel_psd: Sequence[float] = (1e-8,) * 3,
        gyro_psd: Sequence[float] = (8e-14,) * 3,
        accel_sigma: Sequence[float] = (1e-3,) * 3,
        gyro_sigma: Sequence[float] = (5e-8,) * 3,
        extra: Sequence[Measurement] = (),
    ) -> Model:
        blocks = [
            triad("v", "n", (0.1,) * 3),
            triad("phi", "n", (0.17,) * 3),
            triad("a", "b", accel_sigma),
            triad("e", "b", gyro_sigma),
        ]
        rows = AXES["n"]
        z = Measurement(
            "z", rows, rows, "1", (MeasurementTerm("v", identity(3)),), diagonal([0.01, 0.02, 0.03]), "density", frame="n"
        )  # fmt: skip
        process = ProcessParts(TERMS, (white("wa", accel_psd), white("we", gyro_psd)))
        return build_model(blocks, [process], [z, *extra])

    return make
