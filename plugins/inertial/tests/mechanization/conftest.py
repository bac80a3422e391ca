"""Motions with exact increments, and the mechanization run over them, in NumPy and compiled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from estimfw_inertial import compiled, mechanization
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ALL = frozenset(mechanization.OPERATIONS)


@dataclass(frozen=True)
class Sinusoids:
    """Rate of b against i (rad/s) and specific force (m/s^2), in b: a mean and one sinusoid on each of the six axes."""

    mean: FloatArray
    amplitude: FloatArray
    frequency: FloatArray
    phase: FloatArray

    def at(self, t: float) -> FloatArray:
        return self.mean + self.amplitude * np.sin(self.frequency * t + self.phase)

    def increments(self, duration: float, dt: float) -> FloatArray:
        """Integrals (N, 6) over intervals of dt, in closed form."""
        edge = dt * np.arange(round(duration / dt) + 1, dtype=np.float64)[:, None]
        integral = self.mean * edge - self.amplitude / self.frequency * np.cos(self.frequency * edge + self.phase)
        return np.diff(integral, axis=0)


@pytest.fixture(scope="session")
def lively() -> Sinusoids:
    """A vehicle that turns by tenths of a radian, and is pushed to some tens of m/s in a minute."""
    rng = np.random.default_rng(5)
    mean = np.array([0.0, 0.0, 0.01, 0.4, -0.3, 9.8])
    amplitude = np.concatenate([rng.uniform(0.05, 0.2, 3), rng.uniform(0.5, 2.0, 3)])
    return Sinusoids(mean, amplitude, rng.uniform(0.5, 3.0, 6), rng.uniform(0.0, 6.0, 6))


def samples_of(increments: FloatArray, dt: float, per_step: int) -> FloatArray:
    """Samples (K, 1 + 6 per_step) of a mechanization."""
    steps = len(increments) // per_step
    return np.hstack([np.full((steps, 1), dt * per_step), increments[: steps * per_step].reshape(steps, -1)])


def _in_numpy(state: FloatArray, samples: FloatArray, params: FloatArray) -> FloatArray:
    for sample in samples:
        state = mechanization.step(state, sample, params)[0]
    return state


def _compiled(state: FloatArray, samples: FloatArray, params: FloatArray) -> FloatArray:
    state, row, end = state.copy(), np.empty(mechanization.ROW_SIZE), np.empty(mechanization.ROW_SIZE)
    for sample in samples:
        compiled.step(state, sample, params, row, end)
    return state


@pytest.fixture(scope="session", params=["numpy", "compiled"])
def mechanized(request: pytest.FixtureRequest) -> Callable[..., FloatArray]:
    """``mechanized(start, increments, dt, per_step=2, computed=ALL, place=None)``: state (15,) at the end.

    ``place`` (6,) replaces that of the start, so that the Earth may stand still or weigh nothing.
    """
    loop = _in_numpy if request.param == "numpy" else _compiled

    def run(
        start: FloatArray,
        increments: FloatArray,
        dt: float,
        per_step: int = 2,
        computed: frozenset[str] = ALL,
        place: FloatArray | None = None,
    ) -> FloatArray:
        there = mechanization.place_at(start[12], start[14]) if place is None else place
        params = mechanization.pack_params(per_step, computed, 0.5, there)
        return loop(start, samples_of(increments, dt, per_step), params)

    return run
