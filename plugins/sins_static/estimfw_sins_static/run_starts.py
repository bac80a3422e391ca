"""What runs of the experiment begin with: misalignments, velocities and biases, as they are set or drawn for a Monte Carlo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from estimfw_sins_static.simulate import SimulateConfig

__all__ = ["RunStarts", "starts_as_set", "starts_drawn"]

FloatArray = NDArray[np.float64]

#: Setting, and the quantity of the block that the filter has for it.
DRAWN = {"misalignment": "attitude", "velocity": "velocity", "gyro_bias": "gyro_bias", "accel_bias": "accel_bias"}


@dataclass(frozen=True, slots=True)
class RunStarts:
    """Of R runs: ``misalignment`` (R, 3) rad in n, ``velocity`` (R, 3) m/s in n or None (that of the base, 0), ``gyro_bias``
    (R, 3) rad/s and ``accel_bias`` (R, 3) m/s^2 in b."""

    misalignment: FloatArray
    velocity: FloatArray | None
    gyro_bias: FloatArray
    accel_bias: FloatArray


def starts_as_set(cfg: SimulateConfig, runs: int) -> RunStarts:
    """All alike, as the settings say."""
    alike = {
        name: np.tile(np.array(getattr(cfg, name)), (runs, 1)) for name in ("misalignment", "gyro_bias", "accel_bias")
    }
    return RunStarts(velocity=None, **alike)


def starts_drawn(
    cfg: SimulateConfig, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, FloatArray]
) -> RunStarts:
    """Of a Monte Carlo: about the setting where its sigma is given, else from the prior (``draw: prior``), else as set.

    Parameters
    ----------
    cfg : SimulateConfig
    seeds : sequence of R SeedSequence
        Of the runs; their third child is used here.
    start : mapping of str to (R, 3) array
        By quantity, what was drawn from the filter's prior, in the frames of the convention sheet.
    """
    normal = np.stack([np.random.default_rng(_third(seed)).standard_normal((len(DRAWN), 3)) for seed in seeds])
    made: dict[str, FloatArray] = {}
    for k, (name, quantity) in enumerate(DRAWN.items()):
        sigma, about = getattr(cfg, f"{name}_sigma"), np.array(getattr(cfg, name, (0.0,) * 3))
        if sigma is not None:
            made[name] = about + np.array(sigma) * normal[:, k]
        elif cfg.draw == "prior" and quantity in start:
            made[name] = start[quantity]
        else:
            made[name] = np.tile(about, (len(seeds), 1))
    return RunStarts(**made)


def _third(seed: np.random.SeedSequence) -> np.random.SeedSequence:
    return np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 2))
