"""The motion of a vehicle on a route, and what perfect sensors in it measure.

Everything is a cubic spline over the sampling instants: angles and velocity, so that their derivatives are exact, and
increments are integrals over each interval by Gauss's formula of three points (README, E1, E2, 4, 8)::

    omega_ib = C_nb (omega_ie + omega_en) + omega_nb
    f_b      = v_b' + (omega_ib + C_nb omega_ie) x v_b - C_nb g_n
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from estimfw_inertial.earth import (
    earth_rate_n,
    meridian_radius,
    normal_gravity,
    prime_vertical_radius,
    transport_rate_n,
)
from estimfw_inertial.rotation import attitude_matrix
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimfw_sins_odometer.route import Route

__all__ = ["Motion", "Violations", "moved"]

FloatArray = NDArray[np.float64]

_GAUSS = ((-np.sqrt(0.6), 5.0 / 18.0), (0.0, 8.0 / 18.0), (np.sqrt(0.6), 5.0 / 18.0))
#: At this speed (m/s) oscillations have their full amplitude; they grow with the speed, and are none at rest.
FULL = 15.0


@dataclass(frozen=True, slots=True)
class Violations:
    """How the point at which the odometer measures moves other than forward.

    Attributes
    ----------
    slip : float, s
        Sideways speed = slip * speed * rate of heading.
    mounting : float, rad
        One sigma of the direction of the velocity against forward, sideways and upwards.
    oscillation : float, m/s
        Amplitude sideways and upwards at 15 m/s.
    """

    slip: float = 0.01
    mounting: float = float(np.radians(0.05))
    oscillation: float = 0.02


@dataclass(frozen=True, slots=True)
class Motion:
    """A drive at the instants ``time`` (N + 1,) s, the first of them 0.

    ``C_bn`` (N + 1, 3, 3), ``velocity_n`` (N + 1, 3) m/s of the IMU, ``position`` (N + 1, 3) latitude and longitude (rad) and
    height (m), ``track`` (N + 1, 3) east, north, up of the start (m), ``speed``
    (N + 1,) m/s forward at the odometer, ``increments`` (N, 6) rad and m/s.
    """

    time: FloatArray
    C_bn: FloatArray
    velocity_n: FloatArray
    position: FloatArray
    track: FloatArray
    speed: FloatArray
    increments: FloatArray


def moved(
    route: Route,
    time: FloatArray,
    place: tuple[float, float, float],
    violations: Violations,
    lever_arm: FloatArray,
    rng: np.random.Generator,
) -> Motion:
    """The motion on a route from a place (latitude, longitude in rad, height in m); the lever arm (3,) m is in b."""
    v = route.speed_at(time)
    angles = CubicSpline(time, _angles(route, time, v, rng))
    at_odometer = _velocity(v, angles(time, 1)[:, 0], time, violations, rng)
    turning = _turning(angles(time), angles(time, 1))
    velocity = CubicSpline(time, at_odometer - np.cross(turning, lever_arm))
    C_bn = _attitude(angles(time))
    velocity_n = _times(C_bn, velocity(time))
    track = _track(time, velocity_n)
    position = _positions(track, place)
    return Motion(
        time, C_bn, velocity_n, position, track, v, _increments(time, angles, velocity, CubicSpline(time, position))
    )


def _angles(route: Route, time: FloatArray, v: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Heading, pitch, roll (N, 3) rad: hills of some hundred metres, springs at about 1 Hz, leaning in turns."""
    dt = time[1] - time[0]
    way = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]))]) * dt
    heading = route.heading_at(time)
    phase, length = rng.uniform(0.0, 2.0 * np.pi, 8), rng.uniform(300.0, 1500.0, 4)
    hill = np.sin(2.0 * np.pi * way / length[0] + phase[0]) + 0.5 * np.sin(2.0 * np.pi * way / length[1] + phase[1])
    camber = np.sin(2.0 * np.pi * way / length[2] + phase[2]) + 0.5 * np.sin(2.0 * np.pi * way / length[3] + phase[3])
    spring, side = (v / FULL * np.sin(2.0 * np.pi * f * time + p) for f, p in ((1.2, phase[4]), (0.9, phase[5])))
    lean = v * np.gradient(heading, dt) / 2.0
    degrees = np.stack([np.zeros(time.size), 1.5 * hill + 0.3 * spring, camber + 0.3 * side + 0.5 * lean], axis=-1)
    return np.asarray(np.radians(degrees) + np.stack([heading, *np.zeros((2, time.size))], axis=-1))


def _velocity(
    v: FloatArray, heading_rate: FloatArray, time: FloatArray, violations: Violations, rng: np.random.Generator
) -> FloatArray:
    """Of the odometer's point in b (N, 3) m/s."""
    askew, phase = violations.mounting * rng.standard_normal(2), rng.uniform(0.0, 2.0 * np.pi, 2)
    shaken = [
        violations.oscillation * v / FULL * np.sin(2.0 * np.pi * f * time + p)
        for f, p in zip((1.1, 1.4), phase, strict=True)
    ]
    sideways = violations.slip * v * heading_rate + askew[0] * v + shaken[0]
    return np.stack([sideways, v, askew[1] * v + shaken[1]], axis=-1)


def _attitude(angles: FloatArray) -> FloatArray:
    return attitude_matrix(-angles[:, 0], angles[:, 1], angles[:, 2])


def _turning(angles: FloatArray, rates: FloatArray) -> FloatArray:
    """omega_nb in b (N, 3) rad/s (E2)."""
    (_, pitch, roll), (heading_dot, pitch_dot, roll_dot) = angles.T, rates.T
    x = np.cos(roll) * pitch_dot + np.sin(roll) * np.cos(pitch) * heading_dot
    z = np.sin(roll) * pitch_dot - np.cos(roll) * np.cos(pitch) * heading_dot
    return np.stack([x, roll_dot - np.sin(pitch) * heading_dot, z], axis=-1)


def _track(time: FloatArray, velocity_n: FloatArray) -> FloatArray:
    """Way east, north, up (N, 3) m since the start, by trapezoids."""
    mean = 0.5 * (velocity_n[1:] + velocity_n[:-1]) * (time[1] - time[0])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(mean, axis=0)])


def _positions(track: FloatArray, place: tuple[float, float, float]) -> FloatArray:
    """Latitude, longitude, height (N, 3); the radii are those of the start."""
    latitude, longitude, height = place
    R_M, R_N = float(meridian_radius(latitude)) + height, float(prime_vertical_radius(latitude)) + height
    L = latitude + track[:, 1] / R_M
    return np.stack([L, longitude + track[:, 0] / (R_N * np.cos(0.5 * (L + latitude))), height + track[:, 2]], axis=-1)


def _increments(time: FloatArray, angles: CubicSpline, velocity: CubicSpline, position: CubicSpline) -> FloatArray:
    middle, dt = 0.5 * (time[1:] + time[:-1]), time[1] - time[0]
    total = np.zeros((middle.size, 6))
    for place, weight in _GAUSS:
        total += weight * dt * _sensed(middle + 0.5 * place * dt, angles, velocity, position)
    return total


def _sensed(t: FloatArray, angles: CubicSpline, velocity: CubicSpline, position: CubicSpline) -> FloatArray:
    """omega_ib_b and f_b, (N, 6)."""
    now, v_b, (latitude, _, height) = angles(t), velocity(t), position(t).T
    C_nb = np.swapaxes(_attitude(now), -1, -2)
    earth = earth_rate_n(latitude)
    transport = transport_rate_n(_times(np.swapaxes(C_nb, -1, -2), v_b), latitude, height)
    omega = _times(C_nb, earth + transport) + _turning(now, angles(t, 1))
    up = normal_gravity(latitude, height)[:, None] * C_nb[:, :, 2]
    force = velocity(t, 1) + np.cross(omega + _times(C_nb, earth), v_b) + up
    return np.concatenate([omega, force], axis=-1)


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
