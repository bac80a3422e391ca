"""A vehicle that stands, or sways, somewhere on the Earth: exact increments of the motion, then sensor errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from estimfw_inertial.sensor_grade import SensorGrade
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

EARTH_RATE = 7.292115e-5
GRAVITY = 9.8
PERFECT = SensorGrade(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Spot:
    """A place: latitude and longitude in rad, height in m."""

    latitude: float
    longitude: float = 0.0
    height: float = 0.0


@dataclass(frozen=True)
class Standing:
    """How a vehicle stands.

    ``sway`` rad and ``surge`` m/s are amplitudes of sinusoids about and along all axes, with frequencies from half to one and
    a half times ``frequency`` Hz; ``quantum`` m/s is the resolution of the accelerometers.
    """

    latitude: float
    attitude: FloatArray
    duration: float = 60.0
    rate: float = 50.0
    sway: float = 0.0
    surge: float = 0.0
    frequency: float = 0.3
    quantum: float = 0.0
    grade: SensorGrade = PERFECT


@dataclass(frozen=True)
class Measured:
    """Where; t (N,) s, dtheta (N, 3) rad, dvel (N, 3) m/s; and the true C_bn (3, 3) at the end."""

    place: Spot
    t: FloatArray
    dtheta: FloatArray
    dvel: FloatArray
    C_bn: FloatArray


@pytest.fixture(scope="session")
def measure() -> Callable[..., Measured]:
    """``measure(rng, latitude=..., attitude=..., ...)``: the fields of `Standing`."""
    return lambda rng, **fields: _measure(Standing(**fields), rng)


@pytest.fixture
def spot() -> Callable[[float], Spot]:
    """A place of a latitude in rad."""
    return Spot


def _measure(base: Standing, rng: np.random.Generator) -> Measured:
    """The body turns by exp([s x]) from its attitude; both integrals by three Gauss points a step."""
    count, dt = round(base.duration * base.rate), 1.0 / base.rate
    ends = dt * np.arange(count + 1, dtype=np.float64)
    earth_rate = EARTH_RATE * np.array([0.0, np.cos(base.latitude), np.sin(base.latitude)])
    turn, push = _Sinusoids(base.sway, base, rng), _Sinusoids(base.surge, base, rng)
    attitude = Rotation.from_matrix(base.attitude)
    dtheta, dvel = np.zeros((count, 3)), np.zeros((count, 3))
    for place, weight in zip(*np.polynomial.legendre.leggauss(3), strict=True):
        t = ends[:-1] + 0.5 * dt * (1.0 + place)
        to_body = (attitude * Rotation.from_rotvec(turn.at(t))).inv()
        dtheta += 0.5 * dt * weight * (_body_rate(turn.at(t), turn.slope(t)) + to_body.apply(earth_rate))
        dvel += 0.5 * dt * weight * to_body.apply(np.array([0.0, 0.0, GRAVITY]) + push.slope(t))
    C_bn = (attitude * Rotation.from_rotvec(turn.at(ends[-1:])[0])).as_matrix()
    dtheta, dvel = _with_errors(base, dtheta, dvel, dt, rng)
    return Measured(Spot(base.latitude), ends[1:], dtheta, dvel, C_bn)


class _Sinusoids:
    """One about or along each axis, of random frequency and phase."""

    def __init__(self, amplitude: float, base: Standing, rng: np.random.Generator) -> None:
        self.amplitude = amplitude
        self.rate = 2.0 * np.pi * base.frequency * rng.uniform(0.5, 1.5, 3)
        self.start = rng.uniform(0.0, 2.0 * np.pi, 3)

    def at(self, time: FloatArray) -> FloatArray:
        return np.asarray(self.amplitude * np.sin(self.rate * time[:, None] + self.start), dtype=float)

    def slope(self, time: FloatArray) -> FloatArray:
        return np.asarray(self.amplitude * self.rate * np.cos(self.rate * time[:, None] + self.start), dtype=float)


def _body_rate(s: FloatArray, slope: FloatArray) -> FloatArray:
    """Rate of exp([s x]) in its own axes: s' - (1 - cos a)/a^2 s x s' + (a - sin a)/a^3 s x (s x s'), with a = abs(s)."""
    a = np.maximum(np.linalg.norm(s, axis=1, keepdims=True), 1e-3)
    once = np.cross(s, slope)
    return np.asarray(slope - (1.0 - np.cos(a)) / a**2 * once + (a - np.sin(a)) / a**3 * np.cross(s, once), dtype=float)


def _with_errors(
    base: Standing, dtheta: FloatArray, dvel: FloatArray, dt: float, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    g, shape = base.grade, dtheta.shape
    dtheta = dtheta + g.gyro_bias * rng.standard_normal(3) * dt
    dtheta = dtheta + g.angle_random_walk * np.sqrt(dt) * rng.standard_normal(shape)
    dvel = dvel + g.accel_bias * rng.standard_normal(3) * dt
    dvel = dvel + g.velocity_random_walk * np.sqrt(dt) * rng.standard_normal(shape)
    if base.quantum:
        counts = np.round(np.cumsum(dvel, axis=0) / base.quantum)
        dvel = base.quantum * np.diff(counts, axis=0, prepend=np.zeros((1, 3)))
    return dtheta, dvel
