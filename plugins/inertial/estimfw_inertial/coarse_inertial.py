r"""Coarse alignment in inertial frames: right on a base that sways, because the gyros take the swaying out.

The attitude is cut in three (n0, b0: the navigation and body axes at the start, frozen inertially)::

    C_bn(t) = C_n0n(t) C_b0n0 C_bb0(t)

C_bb0 is integrated from the gyros, C_n0n is the turn of the Earth in closed form, and C_b0n0 is constant. It is found
from the velocities that specific force makes in the two frozen frames: v_b0 measured, v_n0 in closed form (the reaction to
gravity, turning with the Earth), in the least squares sense over the whole window (Wahba's problem).

What vectors to compare was settled on a real swaying record (ring laser gyros, 30 minutes cut into windows; heading
against an alignment over all of it, rms in arcmin):

====================================  =====  =====  =====  =====
vectors                                30 s   60 s  120 s  300 s
====================================  =====  =====  =====  =====
velocity minus its mean (used here)     10      4    1.1   0.75
velocity since the start                64     16    4.6   1.1
position                               120     31    8.5   1.6
====================================  =====  =====  =====  =====

Without the mean the velocity at the start, which is as disturbed as any other, is not taken for zero. Velocities are
not normalised: their noise does not grow with their length.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.model.nominal import Share
from estimfw_inertial.coarse_alignment import CoarseAlignment
from estimfw_inertial.coarse_config import CoarseConfig
from estimfw_inertial.coarse_covariance import InertialFit, bias_shares, fit_covariance
from estimfw_inertial.earth import earth_rate_n, normal_gravity
from estimfw_inertial.inertial_path import inertial_path
from estimfw_inertial.place import Place
from estimfw_inertial.rotation import exponential
from estimfw_inertial.sensor_grade import SensorGrade
from estimfw_inertial.standing_attitude import StandingAttitude
from estimfw_inertial.wahba import davenport

__all__ = ["InertialFrameConfig", "build_inertial_frame", "estimate_attitude"]

FloatArray = NDArray[np.float64]


class InertialFrameConfig(CoarseConfig):
    """Settings of ``inertial.inertial_frame``."""

    kind: Literal["inertial.inertial_frame"]


def build_inertial_frame(settings: InertialFrameConfig, site: Place | None) -> CoarseAlignment:
    """The finder.

    Raises
    ------
    ConfigError, NumericalError
        No site, or a pole.
    """
    return CoarseAlignment(settings, site, estimate_attitude, "inertial-frame alignment")


def estimate_attitude(
    time: FloatArray, dtheta: FloatArray, dvel: FloatArray, place: Place, grade: SensorGrade | None = None
) -> StandingAttitude:
    """Attitude of a standing, maybe swaying vehicle at the end of a window.

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
    """
    period = float((time[-1] - time[0]) / (time.size - 1))
    elapsed = period * np.arange(time.size + 1, dtype=np.float64)
    C_bb0, dvel_b0 = inertial_path(dtheta, dvel)
    observed = _centred(np.concatenate([np.zeros((1, 3)), np.cumsum(dvel_b0, axis=0)]))
    velocity = reaction_velocity(elapsed, place)
    reference = _centred(velocity)
    C_b0n0 = davenport(reference, observed)
    residual = observed @ C_b0n0.T - reference
    fit = InertialFit(reference, residual, np.diff(velocity, axis=0), C_b0n0 @ C_bb0[1:], period)
    C_n0n = exponential(-earth_rate_n(place.latitude) * elapsed[-1])
    grade = grade or SensorGrade()
    shares = bias_shares(fit, grade)
    return StandingAttitude(
        C_bn=C_n0n @ C_b0n0 @ C_bb0[-1],
        covariance=C_n0n @ fit_covariance(fit, grade) @ C_n0n.T,
        shares={name: Share(C_n0n @ share.sensitivity, share.covariance) for name, share in shares.items()},
        time=float(time[-1]),
        disturbance=float(np.sqrt(np.mean(np.sum(residual**2, axis=1)))),
    )


def reaction_velocity(elapsed: FloatArray, place: Place) -> FloatArray:
    """Integral of the specific force of a standing vehicle, (N, 3) m/s, in n0, over ``elapsed`` (N,) s."""
    rate_n = earth_rate_n(place.latitude)
    rate = float(np.linalg.norm(rate_n))
    axis = rate_n / rate
    up = np.array([0.0, 0.0, 1.0])
    along = axis * axis[2]
    angle = rate * elapsed[:, None]
    turned = (up - along) * np.sin(angle) + np.cross(axis, up) * 2.0 * np.sin(0.5 * angle) ** 2
    gravity = float(normal_gravity(place.latitude, place.height))
    return np.asarray(gravity * (along * elapsed[:, None] + turned / rate), dtype=float)


def _centred(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors - vectors.mean(axis=0), dtype=float)
