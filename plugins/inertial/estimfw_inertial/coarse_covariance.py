r"""How good an inertial-frame alignment is: every error followed through to the attitude, correlations and all.

The fit is linear in small errors. With r_k the reference velocities minus their mean and dv_k the error of the observed
one, both in n0::

    phi_fit = J^-1 sum_k r_k x dv_k,     J = sum_k (r_k' r_k I - r_k r_k')

dv_k in turn is a sum over the increments before it: of accelerometer errors, and of specific force times the attitude error
psi that the gyros have gathered. Summed backwards once, this gives for every increment the matrix that takes its error to
the attitude at the end, phi = phi_fit - psi(end). Biases and white noise follow from those matrices. That an east
accelerometer bias tilts roll and turns the heading by tan(latitude), or that an east gyro bias turns it by
1/(rate cos(latitude)), is nowhere written in: it comes out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.model.nominal import Share
from estimfw_inertial.rotation import skew
from estimfw_inertial.sensor_grade import SensorGrade

__all__ = ["InertialFit", "bias_shares", "fit_covariance", "slow_disturbance"]

FloatArray = NDArray[np.float64]

#: Degrees of the polynomials that the disturbance is read from: above what the fit absorbs, below the swaying itself.
_DEGREES = (3, 14)


@dataclass(frozen=True, slots=True)
class InertialFit:
    """A fitted window of N increments, all in n0 (east, north, up at the start, frozen inertially).

    Attributes
    ----------
    reference : (N + 1, 3) array, m/s
        Velocities of the reaction to gravity, minus their mean.
    residual : (N + 1, 3) array, m/s
        Observed minus reference, without mean.
    dvel : (N, 3) array, m/s
        Increments of the reference.
    C_bn0 : (N, 3, 3) array
        Takes a vector from b at each increment to n0.
    period : float, s
    """

    reference: FloatArray
    residual: FloatArray
    dvel: FloatArray
    C_bn0: FloatArray
    period: float


def fit_covariance(fit: InertialFit, grade: SensorGrade) -> FloatArray:
    """Covariance (3, 3), rad^2, of the attitude error phi at the end of the window, in n0."""
    per_velocity, per_accel, per_gyro = _per_error(fit)
    parts = (
        *(s.sensitivity @ s.covariance @ s.sensitivity.T for s in bias_shares(fit, grade).values()),
        grade.velocity_random_walk**2 * fit.period * np.einsum("kij,klj->il", per_accel, per_accel),
        grade.angle_random_walk**2 * fit.period * np.einsum("kij,klj->il", per_gyro, per_gyro),
        np.einsum("kij,jm,klm->il", per_velocity, slow_disturbance(fit.residual), per_velocity, optimize=True),
    )
    total = np.sum(parts, axis=0)
    return np.asarray(0.5 * (total + total.T), dtype=float)


def bias_shares(fit: InertialFit, grade: SensorGrade) -> dict[str, Share]:
    """What biases in b do to phi at the end of the window, in n0."""
    _, per_accel, per_gyro = _per_error(fit)
    accel_bias = fit.period * np.einsum("kij,kjl->il", per_accel, fit.C_bn0)
    gyro_bias = fit.period * np.einsum("kij,kjl->il", per_gyro, fit.C_bn0)
    return {
        "accel_bias": Share(accel_bias, grade.accel_bias**2 * np.eye(3)),
        "gyro_bias": Share(gyro_bias, grade.gyro_bias**2 * np.eye(3)),
    }


def _per_error(fit: InertialFit) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Matrices (N, 3, 3) that take errors of each velocity, of each dvel and of each dtheta (in n0) to phi at the end."""
    per_velocity = _per_velocity(fit.reference)
    per_accel = _backward_sum(per_velocity[1:])
    return per_velocity, per_accel, _backward_sum(-per_accel @ skew(fit.dvel)) - np.eye(3)


def slow_disturbance(residual: FloatArray) -> FloatArray:
    """Variance (3, 3), m^2/s^2, of the white sequence that would disturb slow fits as these residuals (N, 3) do.

    Notes
    -----
    A sway of some hertz averages out, a slow one does not, so the plain variance says nothing. The residuals are
    projected on orthonormal polynomials of the degrees just above those that the fit itself absorbs (a series
    estimator of the long-run variance: Lazarus et al., *J. Bus. Econ. Stat.* 36, 2018).
    """
    lowest, highest = _DEGREES
    place = np.linspace(-1.0, 1.0, residual.shape[0])
    shapes = np.linalg.qr(np.polynomial.legendre.legvander(place, highest))[0][:, lowest:]
    weights = shapes.T @ residual
    return np.asarray(weights.T @ weights / shapes.shape[1], dtype=float)


def _per_velocity(reference: FloatArray) -> FloatArray:
    """What each velocity error does to the fit: J^-1 [r_k x], (N, 3, 3)."""
    J = np.sum(reference**2) * np.eye(3) - reference.T @ reference
    return np.asarray(np.linalg.inv(J) @ skew(reference), dtype=float)


def _backward_sum(matrices: FloatArray) -> FloatArray:
    return np.asarray(np.cumsum(matrices[::-1], axis=0)[::-1], dtype=float)
