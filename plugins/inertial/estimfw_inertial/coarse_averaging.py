r"""Coarse alignment by averaging: up is where the mean specific force points, east is across it and the mean rate.

Right only on a base that stands still: a turn of 0.1 deg over five minutes passes for a heading error of 5.5 deg (at 34 deg
latitude). On a real standing vehicle the heading was wrong by 7 deg where the inertial-frame alignment was within 0.02 deg.
It is here because it is simple and known; its covariance says how far it can be trusted.

With up and east from the means f and omega, errors df and domega (n axes) give, to first order (phi as everywhere)::

    phi_E = -df_N/g      phi_N = df_E/g      phi_U = (df_E/g) tan L - domega_E / (omega_ie cos L)
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import DataError
from estimfw.model.nominal import Share
from estimfw_inertial.coarse_alignment import CoarseAlignment
from estimfw_inertial.coarse_config import CoarseConfig
from estimfw_inertial.earth import earth_rate_n, normal_gravity
from estimfw_inertial.place import Place
from estimfw_inertial.sensor_grade import SensorGrade
from estimfw_inertial.standing_attitude import StandingAttitude

__all__ = ["AveragingConfig", "build_averaging", "estimate_attitude"]

FloatArray = NDArray[np.float64]


class AveragingConfig(CoarseConfig):
    """Settings of ``inertial.averaging``."""

    kind: Literal["inertial.averaging"]


def build_averaging(settings: AveragingConfig, site: Place | None) -> CoarseAlignment:
    """The finder.

    Raises
    ------
    ConfigError, NumericalError
        No site, or a pole.
    """
    return CoarseAlignment(settings, site, estimate_attitude, "averaging")


def estimate_attitude(
    time: FloatArray, dtheta: FloatArray, dvel: FloatArray, place: Place, grade: SensorGrade | None = None
) -> StandingAttitude:
    """Mean attitude of a standing vehicle over a window.

    Parameters
    ----------
    time : (N,) array, s
        Ends of N equal sampling intervals, at least 30.
    dtheta : (N, 3) array, rad
        Gyro increments in b.
    dvel : (N, 3) array, m/s
        Accelerometer increments in b.
    place : Place
        Not at a pole.
    grade : SensorGrade, optional
        For the covariance; the estimate does not depend on it.

    Raises
    ------
    DataError
        No specific force, or no rate across it.
    """
    period = float((time[-1] - time[0]) / (time.size - 1))
    duration = period * time.size
    C_bn = _two_directions(dvel.sum(axis=0), dtheta.sum(axis=0))
    angle, velocity = np.cumsum(dtheta @ C_bn.T, axis=0), np.cumsum(dvel @ C_bn.T, axis=0)
    grade = grade or SensorGrade()
    covariance = _covariance(angle, velocity, duration, place, grade)
    swaying = _without_polynomial(velocity, 1)
    disturbance = float(np.sqrt(np.mean(np.sum(swaying**2, axis=1))))
    return StandingAttitude(C_bn, covariance, _bias_shares(C_bn, place, grade), float(time[-1]), disturbance)


def _two_directions(force_b: FloatArray, rate_b: FloatArray) -> FloatArray:
    """C_bn from up and from the rate, whose part across up points north (TRIAD)."""
    east_b = np.cross(rate_b, force_b)
    if not np.linalg.norm(east_b) > 0.0:
        raise DataError(
            "the mean rate and the mean specific force show no north",
            hint="are the gyro and accelerometer columns empty?",
        )
    up = force_b / np.linalg.norm(force_b)
    east = east_b / np.linalg.norm(east_b)
    return np.stack([east, np.cross(up, east), up])


def _covariance(
    angle: FloatArray, velocity: FloatArray, duration: float, place: Place, grade: SensorGrade
) -> FloatArray:
    """Of phi at the end of the window, (3, 3) in rad^2, from paths (N, 3) in rad and m/s, in n."""
    gravity = float(normal_gravity(place.latitude, place.height))
    swaying = _spread(_without_polynomial(angle, 1))
    force = (grade.accel_bias**2 + grade.velocity_random_walk**2 / duration) * np.eye(3)
    force = force + 2.0 * _spread(_without_polynomial(velocity, 1)) / duration**2
    drift = _level_drift(velocity, duration, gravity)
    rate = (grade.gyro_bias**2 + grade.angle_random_walk**2 / duration) * np.eye(3)
    rate = rate + 2.0 * swaying / duration**2 + np.outer(drift, drift)
    to_tilt, to_heading = _to_attitude(place)
    moved = swaying + np.outer(drift, drift) * duration**2 / 4.0
    return np.asarray(to_tilt @ force @ to_tilt.T + to_heading @ rate @ to_heading.T + moved, dtype=float)


def _to_attitude(place: Place) -> tuple[FloatArray, FloatArray]:
    """What errors of mean specific force (m/s^2) and of mean rate (rad/s), in n, do to phi: the equations above."""
    _, north, up = earth_rate_n(place.latitude)
    gravity = float(normal_gravity(place.latitude, place.height))
    to_tilt = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [up / north, 0.0, 0.0]]) / gravity
    to_heading = np.zeros((3, 3))
    to_heading[2, 0] = -1.0 / north
    return to_tilt, to_heading


def _bias_shares(C_bn: FloatArray, place: Place, grade: SensorGrade) -> dict[str, Share]:
    to_tilt, to_heading = _to_attitude(place)
    return {
        "accel_bias": Share(to_tilt @ C_bn, grade.accel_bias**2 * np.eye(3)),
        "gyro_bias": Share(to_heading @ C_bn, grade.gyro_bias**2 * np.eye(3)),
    }


def _level_drift(velocity: FloatArray, duration: float, gravity: float) -> FloatArray:
    """How fast the level seems to turn, rad/s: a steady turn hides in the mean rate, the accelerometers see it."""
    place = np.linspace(0.0, duration, velocity.shape[0])
    quadratic = np.polynomial.polynomial.polyfit(place, velocity, 2)[2]
    return np.array([quadratic[1], -quadratic[0], 0.0]) * 2.0 / gravity


def _without_polynomial(path: FloatArray, degree: int) -> FloatArray:
    shapes = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, path.shape[0]), degree))[0]
    return np.asarray(path - shapes @ (shapes.T @ path), dtype=float)


def _spread(path: FloatArray) -> FloatArray:
    return np.asarray(path.T @ path / path.shape[0], dtype=float)
