"""Alignment of a levelled platform as a config of generic components: ten states, two of them measured."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from estimfw.config.compose import Problem

DEG = np.pi / 180.0
BLOCKS = """\
estimfw: 1
blocks:
  velocity: {kind: random_walk, unit: m/s, axes: [x, y], sigma: 0.1 m/s, noise: 5 ug/sqrt(Hz)}
  tilt: {kind: random_walk, unit: rad, axes: [x, y], sigma: 0.1 deg, noise: 0.001 deg/sqrt(h)}
  azimuth: {kind: random_walk, unit: rad, sigma: 1 deg, noise: 0.001 deg/sqrt(h)}
  accel_bias: {kind: random_constant, unit: m/s^2, axes: [x, y], sigma: 50 ug}
  gyro_drift: {kind: random_constant, unit: rad/s, axes: [x, y, z], sigma: 0.02 deg/h}
measurements:
  zero_velocity: {kind: direct, of: [{block: velocity}], noise: 0.01 m/s}
"""


def couplings(alpha: float) -> dict[str, list[list[float]]]:
    """Coefficients of 'target < source' at 39.1 deg latitude, the platform turned by alpha from East."""
    rate, gravity, radius = 7.292115e-5, 9.80665, 6371000.0
    up, north, tan = rate * np.sin(39.1 * DEG), rate * np.cos(39.1 * DEG), np.tan(39.1 * DEG)
    c, s = float(np.cos(alpha)), float(np.sin(alpha))
    return {
        "velocity < velocity": [[0.0, 2.0 * up], [-2.0 * up, 0.0]],
        "velocity < tilt": [[0.0, -gravity], [gravity, 0.0]],
        "velocity < accel_bias": [[c, -s], [s, c]],
        "tilt < tilt": [[0.0, up], [-up, 0.0]],
        "tilt < azimuth": [[-north], [0.0]],
        "tilt < velocity": [[0.0, -1.0 / radius], [1.0 / radius, 0.0]],
        "tilt < gyro_drift": [[c, -s, 0.0], [s, c, 0.0]],
        "azimuth < tilt": [[north, 0.0]],
        "azimuth < velocity": [[tan / radius, 0.0]],
        "azimuth < gyro_drift": [[0.0, 0.0, 1.0]],
    }


@pytest.fixture(scope="session")
def alignment(composed: Callable[[str], Problem]) -> Callable[..., Problem]:
    """``alignment(estimator, steps, alpha)``: the problem with a section ``estimator`` as plain values."""

    def made(estimator: dict[str, object], steps: int = 1200, alpha: float = 30.0) -> Problem:
        process = {
            f"term{i}": {"kind": "couple", "target": pair.split()[0], "source": pair.split()[2], "coefficient": value}
            for i, (pair, value) in enumerate(couplings(alpha * DEG).items())
        }
        source = {"kind": "simulate_model", "duration": f"{steps} s", "rate": "1 Hz", "seed": 3}
        sections = {"process": process, "estimator": estimator, "source": source}
        return composed(BLOCKS + "".join(f"{name}: {json.dumps(value)}\n" for name, value in sections.items()))

    return made


@pytest.fixture(scope="session")
def nodes() -> Callable[[Sequence[str]], list[dict[str, object]]]:
    """``nodes(["velocity[x] tilt", ...])``: a node for each list of states; who owns a velocity measures it."""

    def made(groups: Sequence[str]) -> list[dict[str, object]]:
        return [
            {
                "name": f"n{i}",
                "blocks": group.split(),
                "measurements": [f"zero_velocity[{axis}]" for axis in "xy" if f"velocity[{axis}]" in group],
            }
            for i, group in enumerate(groups)
        ]

    return made
