"""The public record `lasergyro`, runs of the examples over it, and a textbook filter that owes nothing to estimfw.

The textbook has quaternions, a full gain and Phi to second order; settings are those that come with the record.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import load_document
from estimfw.data.record import Record
from estimfw.registry.load import load_plugins
from estimfw.run.run import Collected, run_problem

FloatArray = NDArray[np.float64]
Run = Callable[..., Collected]

REPOSITORY = Path(__file__).parents[4]


def skew(v: FloatArray) -> FloatArray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def product(p: FloatArray, q: FloatArray) -> FloatArray:
    """Of quaternions (w, x, y, z)."""
    return np.array([
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ])  # fmt: skip


def quaternion(v: FloatArray) -> FloatArray:
    """Of a rotation vector."""
    angle = float(np.sqrt(v @ v))
    return np.concatenate([[np.cos(angle / 2.0)], 0.5 * np.sinc(angle / (2.0 * np.pi)) * v])


def matrix(q: FloatArray) -> FloatArray:
    w, x, y, z = q
    return np.array([
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ])  # fmt: skip


def angles(C: FloatArray) -> FloatArray:
    """yaw, pitch, roll in deg."""
    return np.asarray(np.degrees([np.arctan2(-C[0, 1], C[1, 1]), np.arcsin(C[2, 1]), np.arctan2(-C[2, 0], C[2, 2])]))


@dataclass(frozen=True)
class Textbook:
    """A closed-loop filter with 12 states (biases in b) or 7 (n-frame biases, no Coriolis, V_U held at 0)."""

    states: int = 12
    constant_force: bool = False

    def align(self, dtheta: FloatArray, dvel: FloatArray, yaw: float) -> FloatArray:
        """yaw, pitch, roll (K, 3) in deg after each pair of samples, from a level start at ``yaw`` deg."""
        latitude, height, T = np.radians(34.246048), 380.0, 0.02
        g = (
            9.780325 * (1.0 + 0.0053024 * np.sin(latitude) ** 2 - 5.82e-6 * np.sin(2.0 * latitude) ** 2)
            - 3.086e-6 * height
        )
        w = 7.292115e-5 * np.array([0.0, np.cos(latitude), np.sin(latitude)])
        keep = np.arange(12) if self.states == 12 else np.array([0, 1, 3, 4, 5, 10, 11])
        P, Q = (np.diag(d)[np.ix_(keep, keep)] for d in self._prior_and_noise(T))
        rows, x, unit = (3 if self.states == 12 else 2), np.zeros(keep.size), np.eye(keep.size)
        H, R = unit[:rows], np.eye(rows) * 0.1**2 / T
        q, V = quaternion(np.array([0.0, 0.0, np.radians(yaw)])), np.zeros(3)
        turn, half_turn, half = quaternion(-w * T), quaternion(-w * T / 2.0), np.eye(3) - skew(w * T / 2.0)
        found = np.empty((len(dtheta) // 2, 3))
        for k in range(len(found)):
            t1, t2, v1, v2 = dtheta[2 * k], dtheta[2 * k + 1], dvel[2 * k], dvel[2 * k + 1]
            phi = t1 + t2 + 2.0 / 3.0 * skew(t1) @ t2
            push = v1 + v2 + 0.5 * skew(t1 + t2) @ (v1 + v2) + 2.0 / 3.0 * (skew(t1) @ v2 + skew(v1) @ t2)
            C_middle = matrix(product(half_turn, product(q, quaternion(phi / 2.0))))
            coriolis = 2.0 * skew(w) @ V if self.states == 12 else np.zeros(3)
            V = V + half @ matrix(q) @ push + T * (np.array([0.0, 0.0, -g]) - coriolis)
            V[rows:] = 0.0
            q = product(turn, product(q, quaternion(phi)))
            q /= np.sqrt(q @ q)
            f = np.array([0.0, 0.0, g]) if self.constant_force else C_middle @ (v1 + v2) / T
            F = self._dynamics(C_middle, f, w)[np.ix_(keep, keep)] * T
            Phi = unit + F + 0.5 * F @ F
            P = Phi @ P @ Phi.T + Q
            x = Phi @ x
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            x = x + K @ (V[:rows] - H @ x)
            P = (unit - K @ H) @ P @ (unit - K @ H).T + K @ R @ K.T
            V[:rows] -= x[:rows]
            q = product(quaternion(x[rows : rows + 3]), q)
            x[: rows + 3] = 0.0
            found[k] = angles(matrix(q))
        return found

    @staticmethod
    def _prior_and_noise(T: float) -> tuple[FloatArray, FloatArray]:
        ug, deg = 9.80665e-6, np.radians(1.0)
        sigma = np.repeat([0.1, 0.5 * deg, 100.0 * ug, 0.03 * deg / 3600.0], 3)
        sigma[5] = 5.0 * deg
        walk = np.repeat([10.0 * ug, 0.001 * deg / 60.0, 0.0, 0.0], 3)
        return sigma**2, walk**2 * T

    def _dynamics(self, C: FloatArray, f: FloatArray, w: FloatArray) -> FloatArray:
        F = np.zeros((12, 12))
        F[:3, 3:6], F[3:6, 3:6] = skew(f), -skew(w)
        if self.states == 12:
            F[:3, :3], F[:3, 6:9], F[3:6, 9:] = -2.0 * skew(w), C, -C
        else:
            F[3:6, 9:] = -np.eye(3)
        return F


@pytest.fixture(scope="module")
def run(lasergyro: Path) -> Run:
    """``run(states, *overrides, file=...)``: an example over the record, which is read once for each file and window."""
    registry = load_plugins(core_components())
    records: dict[tuple[str, ...], Record] = {}

    def running(states: int, *overrides: str, file: str = "lasergyro.npz") -> Collected:
        config = REPOSITORY / "examples" / f"lasergyro_{states}.yaml"
        document = load_document(config, [f"source.file={lasergyro / file}", *overrides])
        key = (file, *(o for o in overrides if o.startswith("source.")))
        done = run_problem(compose(document, registry), record=records.get(key))
        records[key] = done.prepared.record
        return done

    return running


@pytest.fixture(scope="module")
def window(lasergyro: Path) -> tuple[FloatArray, FloatArray]:
    """dtheta, dvel of samples 100 to 30000, straight from the file."""
    with np.load(lasergyro / "lasergyro.npz") as file:
        return file["dtheta"][99:30000], file["dvel"][99:30000]


@pytest.fixture(scope="session")
def textbook() -> Callable[..., FloatArray]:
    """``textbook(window, yaw, states=12, constant_force=False)``: yaw, pitch, roll (K, 3) in deg."""

    def aligned(
        window: tuple[FloatArray, FloatArray], yaw: float = -92.0, states: int = 12, constant_force: bool = False
    ) -> FloatArray:
        return Textbook(states, constant_force).align(window[0], window[1], yaw)

    return aligned
