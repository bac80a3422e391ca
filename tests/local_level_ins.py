"""A local-level INS frozen at one place, in matrices and as a config of generic parts: something real to discretise and to stage.

Error equations of a platform INS (Wu, Tsang, Nie), with tilts alpha, beta and azimuth gamma, at 45 deg latitude and 20 kn to the
northeast. Written here apart from any plugin.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["ARCMIN", "DEG_PER_HOUR", "MICRO_G", "STATES", "config", "matrices"]

FloatArray = NDArray[np.float64]

ARCMIN, DEG_PER_HOUR, MICRO_G = np.pi / 10800.0, np.pi / 648000.0, 9.80665e-6
RATE, GRAVITY = 7.292115e-5, 9.80665
GYRO_NOISE, ACCEL_NOISE = 0.001 * np.pi / 10800.0, 10.0 * MICRO_G
TAU, DRIFT = 3600.0, 0.01 * DEG_PER_HOUR

COMMON = {"tilt": 2, "azimuth": 1, "velocity": 2, "latitude": 1}
STATES = {
    "const11": {**COMMON, "gyro_bias": 3, "accel_bias": 2},
    "gm9": {**COMMON, "gyro_drift": 3},
    "full14": {**COMMON, "gyro_bias": 3, "accel_bias": 2, "gyro_drift": 3},
}
"""Blocks of each model and how many states each has, in their order."""


def _radii(latitude: float) -> tuple[float, float]:
    e2 = 6.69437999014e-3
    w = 1.0 - e2 * np.sin(latitude) ** 2
    return 6378137.0 * (1.0 - e2) / w**1.5, 6378137.0 / np.sqrt(w)


def common_dynamics() -> FloatArray:
    """d/dt of tilt, azimuth, velocity error and latitude error by themselves, (6, 6)."""
    phi = np.pi / 4.0
    meridian, normal = _radii(phi)
    east = north = 20.0 * 1852.0 / 3600.0 * np.sin(np.pi / 4.0)
    sin, cos, tan = np.sin(phi), np.cos(phi), np.tan(phi)
    wy, wz = RATE * cos + east / normal, RATE * sin + east * tan / normal
    k = 2.0 * RATE * cos + east / (cos**2 * normal)
    return np.array([
        [0.0, wz, -wy, 0.0, -1.0 / meridian, 0.0],
        [-wz, 0.0, -north / meridian, 1.0 / normal, 0.0, -RATE * sin],
        [wy, north / meridian, 0.0, tan / normal, 0.0, RATE * cos + east / (cos**2 * normal)],
        [0.0, -GRAVITY, 0.0, north * tan / normal, 2.0 * RATE * sin + east * tan / normal, k * north],
        [GRAVITY, 0.0, 0.0, -2.0 * (RATE * sin + east * tan / normal), 0.0, -k * east],
        [0.0, 0.0, 0.0, 0.0, 1.0 / meridian, 0.0],
    ])  # fmt: skip


def matrices(model: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """F (n, n), D (n, n) and the prior sigmas (n,) of ``const11``, ``gm9`` or ``full14``."""
    meridian, _ = _radii(np.pi / 4.0)
    sigmas = {
        "tilt": 2.0 * ARCMIN, "azimuth": 6.0 * ARCMIN, "velocity": 0.1, "latitude": 10.0 / meridian,
        "gyro_bias": 0.1 * DEG_PER_HOUR, "accel_bias": 100.0 * MICRO_G, "gyro_drift": DRIFT,
    }  # fmt: skip
    sizes = STATES[model]
    n, at = sum(sizes.values()), dict(zip(sizes, np.cumsum([0, *sizes.values()]).tolist(), strict=False))
    F, D = np.zeros((n, n)), np.zeros((n, n))
    F[:6, :6] = common_dynamics()
    D[:5, :5] = np.diag([GYRO_NOISE**2] * 3 + [ACCEL_NOISE**2] * 2)
    for name in ("gyro_bias", "gyro_drift"):
        if name in at:
            F[:3, at[name] : at[name] + 3] = np.eye(3)
    if "accel_bias" in at:
        F[3:5, at["accel_bias"] : at["accel_bias"] + 2] = np.eye(2)
    if "gyro_drift" in at:
        own = slice(at["gyro_drift"], at["gyro_drift"] + 3)
        F[own, own], D[own, own] = -np.eye(3) / TAU, np.eye(3) * 2.0 * DRIFT**2 / TAU
    return F, D, np.concatenate([np.full(size, sigmas[name]) for name, size in sizes.items()])


def config(
    model: str,
    *,
    measured: Sequence[str] = ("velocity_fix", "heading"),
    duration: float = 14400.0,
    rate: float = 0.1,
    noise: bool = True,
    estimator: str = "{kind: kalman, discretisation: {evaluation: start}}",
    more: str = "",
) -> str:
    """The same as a config; the source simulates the model at ``rate`` Hz. ``more`` is put at its end."""
    sizes = STATES[model]
    blocks = [
        f"  tilt: {{kind: random_walk, unit: rad, axes: [x, y], sigma: 2 arcmin, noise: {GYRO_NOISE!r} rad/sqrt(s)}}",
        f"  azimuth: {{kind: random_walk, unit: rad, sigma: 6 arcmin, noise: {GYRO_NOISE!r} rad/sqrt(s)}}",
        f"  velocity: {{kind: random_walk, unit: m/s, axes: [x, y], sigma: 0.1 m/s, noise: {ACCEL_NOISE!r} m/s/sqrt(s)}}",
        f"  latitude: {{kind: random_constant, unit: rad, sigma: {float(matrices('gm9')[2][5])!r} rad}}",
    ]
    couplings, F = list[tuple[str, str, FloatArray]](), common_dynamics()
    at = dict(zip(COMMON, np.cumsum([0, *COMMON.values()]).tolist(), strict=False))
    for target, rows in COMMON.items():
        for source, columns in COMMON.items():
            part = F[at[target] : at[target] + rows, at[source] : at[source] + columns]
            couplings += [(target, source, part)] if np.any(part) else []
    if "gyro_bias" in sizes:
        blocks.append("  gyro_bias: {kind: random_constant, unit: rad/s, axes: [x, y, z], sigma: 0.1 deg/h}")
        couplings += [("tilt", "gyro_bias", np.eye(3)[:2]), ("azimuth", "gyro_bias", np.eye(3)[2:])]
    if "accel_bias" in sizes:
        blocks.append("  accel_bias: {kind: random_constant, unit: m/s^2, axes: [x, y], sigma: 100 ug}")
        couplings.append(("velocity", "accel_bias", np.eye(2)))
    if "gyro_drift" in sizes:
        sigma = "sigma: 0.01 deg/h, steady_sigma: 0.01 deg/h, correlation_time: 1 h"
        blocks.append(f"  gyro_drift: {{kind: gauss_markov, unit: rad/s, axes: [x, y, z], {sigma}}}")
        couplings += [("tilt", "gyro_drift", np.eye(3)[:2]), ("azimuth", "gyro_drift", np.eye(3)[2:])]
    process = [
        f"  {target}_by_{source}: {{kind: couple, target: {target}, source: {source}, coefficient: {part.tolist()}}}"
        for target, source, part in couplings
    ]
    references = {
        "velocity_fix": "  velocity_fix: {kind: direct, of: [{block: velocity}], noise: 0.05 m/s}",
        "heading": "  heading: {kind: direct, of: [{block: azimuth}], noise: 6 arcmin}",
    }
    return "\n".join([
        "estimfw: 1", f"name: local-level INS, {model}", "blocks:", *blocks, "process:", *process, "measurements:",
        *(references[name] for name in measured), f"estimator: {estimator}",
        f"source: {{kind: simulate_model, duration: {duration!r} s, rate: {rate!r} Hz, noise: {str(noise).lower()}, seed: 1}}",
        more, "",
    ])  # fmt: skip
