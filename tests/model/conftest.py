"""Two frames, ``b`` turning in ``n``, and parts to build small models from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.model.coefficient import identity
from estimfw.model.frame import Frame
from estimfw.model.parts import BlockParts, Measurement, MeasurementTerm, NoiseInput, StateBlock

FloatArray = NDArray[np.float64]


@pytest.fixture
def frames() -> tuple[Frame, Frame]:
    return (
        Frame("n", ("E", "N", "U")),
        Frame("b", ("R", "F", "U"), parent="n", rotation="C_bn", rate="omega_nb_n"),
    )


@pytest.fixture
def nominal() -> dict[str, FloatArray]:
    """A tilted body that turns, and a specific force."""
    return {
        "C_bn": Rotation.from_euler("ZXY", [40.0, 20.0, -30.0], degrees=True).as_matrix(),
        "omega_nb_n": np.array([0.3, -0.2, 0.5]),
        "f_n": np.array([0.4, -0.7, 9.8]),
    }


@pytest.fixture
def block(frames: tuple[Frame, Frame]) -> Callable[..., BlockParts]:
    """``block("a", "b", sigma=(1, 2, 3))``: a triad in a frame, or (frame None) one state of its own."""

    def make(name: str, frame: str | None = None, sigma: Sequence[float] | None = None, **more: Any) -> BlockParts:
        axes = next((f.axes for f in frames if f.name == frame), ("",))
        sigmas = tuple(sigma) if sigma is not None else (1.0,) * len(axes)
        covariance = tuple(tuple(float(x) for x in row) for row in np.diag(np.square(sigmas)))
        state = StateBlock(name, axes, axes, "1", frame=frame, home_frame=frame)
        mean = (0.0,) * len(axes)
        return BlockParts(state, covariance, mean, frames=frames, **more)

    return make


@pytest.fixture
def noise(frames: tuple[Frame, Frame]) -> Callable[..., NoiseInput]:
    """``noise("w", "b", psd=(1, 1, 1))``."""

    def make(name: str, frame: str, psd: Sequence[float]) -> NoiseInput:
        axes = next(f.axes for f in frames if f.name == frame)
        return NoiseInput(name, axes, axes, tuple(float(q) for q in psd), "1", frame=frame)

    return make


@pytest.fixture
def reading() -> Callable[..., Measurement]:
    """``reading("z", "a", frame="n")``: a triad read as it is."""

    def make(name: str, block: str, frame: str | None = None, rows: tuple[str, ...] = ("x", "y", "z")) -> Measurement:
        return Measurement(
            name, rows, rows, "1", (MeasurementTerm(block, identity(3)),),
            tuple(tuple(float(x) for x in row) for row in np.eye(3)), "per_measurement", frame=frame,
        )  # fmt: skip

    return make
