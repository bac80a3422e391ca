"""What the tests of this package share: the examples, and an independent, naive alignment to compare with.

`naive_alignment` is written from the specification of the paper's experiment alone: dense matrices, one epoch after the
other, its own rotations and constants. It shares no line with the program.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import load_document
from estimfw.montecarlo.campaign import run_campaign
from estimfw.montecarlo.dataset import campaign_dataset
from estimfw.registry.load import load_plugins
from estimfw.registry.registry import Registry
from estimfw.run.run import Collected, run_problem

FloatArray = NDArray[np.float64]
Triple = tuple[float, float, float]

EXAMPLES = Path(__file__).parents[3] / "examples"

DEGREE = np.pi / 180.0
EARTH_RATE = 7.292115e-5
LATITUDE = 34.0 * DEGREE
GRAVITY = 9.796184
W = np.array([0.0, EARTH_RATE * np.cos(LATITUDE), EARTH_RATE * np.sin(LATITUDE)])
ANGLE_WALK = 0.001 * DEGREE / 60.0
GYRO_BIAS = 0.01 * DEGREE / 3600.0
MICRO_G = 9.80665e-6

#: Columns of the 12 states dV, phi, a, eps that the smaller filters keep.
KEPT = {12: list(range(12)), 10: [0, 1, 3, 4, 5, 6, 7, 9, 10, 11], 7: [0, 1, 3, 4, 5, 10, 11]}


@dataclass(frozen=True)
class NaiveRun:
    """Errors of the corrected heading (ccw), pitch, roll, in deg, and the estimates, after each epoch."""

    error: FloatArray
    estimate: FloatArray


def cross(v: FloatArray) -> FloatArray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def expm(v: FloatArray) -> FloatArray:
    """Rodrigues; the cosine by the half angle, which a small one needs."""
    angle = max(float(np.linalg.norm(v)), 1e-300)
    half = np.sin(0.5 * angle) / angle
    return np.asarray(np.eye(3) + np.sin(angle) / angle * cross(v) + 2.0 * half**2 * cross(v) @ cross(v))


def euler_matrix(yaw: float, pitch: float, roll: float) -> FloatArray:
    """Rz Rx Ry, angles in deg."""
    axes = (np.array([0.0, 0.0, yaw]), np.array([pitch, 0.0, 0.0]), np.array([0.0, roll, 0.0]))
    return np.asarray(expm(axes[0] * DEGREE) @ expm(axes[1] * DEGREE) @ expm(axes[2] * DEGREE))


def euler_angles(R: FloatArray) -> FloatArray:
    """Heading (ccw), pitch, roll in deg."""
    return np.array([np.arctan2(-R[0, 1], R[1, 1]), np.arcsin(R[2, 1]), np.arctan2(-R[2, 0], R[2, 2])]) / DEGREE


def naive_matrices(states: int, R: FloatArray, coriolis: bool, g: float) -> tuple[FloatArray, FloatArray]:
    """F and the diffusion of the 12-state phi-angle model, and of its 10- and 7-state reductions.

    The 7 states have n-frame biases (R = I in the coefficients); the others keep body-frame ones.
    """
    turn = np.eye(3) if states == 7 else R
    F = np.zeros((12, 12))
    F[0:3, 0:3] = -2.0 * cross(W) if coriolis else 0.0
    F[0:3, 3:6] = cross(np.array([0.0, 0.0, g]))
    F[0:3, 6:9] = turn
    F[3:6, 3:6] = -cross(W)
    F[3:6, 9:12] = -turn
    D = np.diag([(10.0 * MICRO_G) ** 2] * 3 + [ANGLE_WALK**2] * 3 + [0.0] * 6)
    kept = np.ix_(KEPT[states], KEPT[states])
    return F[kept], D[kept]


def naive_alignment(
    states: int,
    misalignment: Triple,
    *,
    attitude: Triple = (0.0, 0.0, 0.0),
    gyro_bias: ArrayLike = (GYRO_BIAS,) * 3,
    accel_bias: ArrayLike = (100.0 * MICRO_G,) * 3,
    increments: FloatArray | None = None,
    gravity: float = GRAVITY,
    epochs: int = 600,
) -> NaiveRun:
    """Misalignment and attitude in deg, biases in rad/s and m/s^2; ``increments`` (epochs, 6) replace the ideal ones."""
    coriolis, up = states != 7, np.array([0.0, 0.0, gravity])
    R_true = euler_matrix(*attitude)
    R = expm(-np.asarray(misalignment, dtype=float) * DEGREE) @ R_true
    dtheta = R_true.T @ W + np.asarray(gyro_bias)
    dvel = R_true.T @ up + np.asarray(accel_bias)
    V = np.zeros(3)
    rows = 3 if states == 12 else 2
    x = np.zeros(states)
    P = np.diag(np.array([0.1] * 3 + [10.0 * DEGREE] * 3 + [100.0 * MICRO_G] * 3 + [GYRO_BIAS] * 3) ** 2)
    P = P[np.ix_(KEPT[states], KEPT[states])]
    H = np.eye(rows, states)
    errors, estimates = [], []
    for k in range(epochs):
        if increments is not None:
            dtheta, dvel = increments[k, :3], increments[k, 3:]
        R_middle = expm(-0.5 * W) @ R @ expm(0.5 * dtheta)
        V = V + R_middle @ dvel - up - (2.0 * np.cross(W, V) if coriolis else 0.0)
        if states != 12:
            V[2] = 0.0
        R = expm(-W) @ R @ expm(dtheta)
        F, Q = naive_matrices(states, R_middle, coriolis, gravity)
        Phi = np.eye(states) + F + 0.5 * F @ F
        x, P = Phi @ x, Phi @ P @ Phi.T + Q
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + 0.01 * np.eye(rows))
        x = x + K @ (V[:rows] - H @ x)
        joseph = np.eye(states) - K @ H
        P = joseph @ P @ joseph.T + 0.01 * K @ K.T
        phi = x[rows : rows + 3]
        difference = euler_angles(expm(phi) @ R) - euler_angles(R_true)
        errors.append((difference + 180.0) % 360.0 - 180.0)
        estimates.append(x)
    return NaiveRun(np.array(errors), np.array(estimates))


@pytest.fixture(scope="session")
def naive() -> Callable[..., NaiveRun]:
    """`naive_alignment`; the plain experiment is computed once for all tests."""
    plain = lru_cache(naive_alignment)

    def make(states: int, misalignment: Triple, **more: Any) -> NaiveRun:
        return naive_alignment(states, misalignment, **more) if more else plain(states, misalignment)

    return make


def quotient_map(ten: Sequence[str], seven: Sequence[str], reference: Mapping[str, FloatArray]) -> FloatArray:
    """T (7, 10): the combinations of the 10 states (biases in n) that the 7 stand for."""
    g, (_, w_N, w_U) = float(reference["gravity"]), reference["earth_rate_n"]
    combinations = {
        "attitude_error[E]": {"accel_bias[N]": 1.0 / g},
        "attitude_error[N]": {"accel_bias[E]": -1.0 / g},
        "attitude_error[U]": {"gyro_bias[E]": 1.0 / w_N, "accel_bias[E]": -w_U / w_N / g},
        "gyro_bias[N]": {"accel_bias[N]": -w_U / g},
        "gyro_bias[U]": {"accel_bias[N]": w_N / g},
    }
    T = np.zeros((len(seven), len(ten)))
    for i, label in enumerate(seven):
        for source, weight in {label: 1.0, **combinations.get(label, {})}.items():
            T[i, ten.index(source)] = weight
    return T


@pytest.fixture(scope="session")
def quotient() -> Callable[..., FloatArray]:
    """`quotient_map`."""
    return quotient_map


@pytest.fixture(scope="session")
def registry() -> Registry:
    return load_plugins(core_components())


@pytest.fixture(scope="session")
def composed(registry: Registry) -> Callable[..., Problem]:
    """``composed("static_7", "a.b=1", ...)``: an example with overrides, everything but the run."""

    def make(example: str, *overrides: str) -> Problem:
        return compose(load_document(EXAMPLES / f"{example}.yaml", overrides), registry)

    return make


@pytest.fixture(scope="session")
def ran(composed: Callable[..., Problem]) -> Callable[..., Collected]:
    """``ran("static_7", "a.b=1", ...)``: an example with overrides, run."""

    def make(example: str, *overrides: str) -> Collected:
        return run_problem(composed(example, *overrides))

    return make


@pytest.fixture(scope="session")
def end_error(ran: Callable[..., Collected]) -> Callable[..., FloatArray]:
    """Errors of yaw, pitch, roll (3,) in deg at the end of an example with overrides."""

    def make(example: str, *overrides: str) -> FloatArray:
        done = ran(example, *overrides)
        assert done.output_error is not None
        return np.asarray(np.degrees(done.output_error[-1, :3]))

    return make


@pytest.fixture(scope="session")
def misaligned() -> Callable[..., str]:
    """The override for a misalignment about E, N, U in deg (one number: the same about all three)."""

    def text(*angles: float) -> str:
        three = angles * 3 if len(angles) == 1 else angles
        return "source.misalignment=[" + ", ".join(f"{a!r} deg" for a in three) + "]"

    return text


@pytest.fixture(scope="session")
def monte_carlo() -> Callable[..., xr.Dataset]:
    """The statistics of so many runs of a composed problem."""
    return lambda problem, runs, seed=2024: campaign_dataset(run_campaign(problem, seed, runs))


@pytest.fixture(scope="session")
def verdicts() -> Callable[[xr.Dataset], dict[tuple[str, str], str]]:
    """What is not consistent, by figure and quantity: the verdict."""

    def failed(dataset: xr.Dataset) -> dict[tuple[str, str], str]:
        entries = json.loads(dataset.attrs["judged"])
        return {(e["figure"], e["quantity"]): e["verdict"] for e in entries if e["checked"] and not e["consistent"]}

    return failed
