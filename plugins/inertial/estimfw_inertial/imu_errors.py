r"""What a real IMU does to true increments, and how bad IMUs of a grade are.

For each axis of gyro and accelerometer, over an interval dt, with the true increment u (rad, or m/s)::

    measured = quantised( (1 + s) u + (b + m) dt + w sqrt(dt) n ),    n ~ N(0, 1)

s is the scale factor error, b the bias (both: a given value plus one drawn for the run), m a first-order Gauss-Markov process
of deviation sigma and correlation time tau, stationary from the start and constant over an interval, w the density of the
white noise (angle or velocity random walk). Quantised: a counter sums the increments and hands over whole counts; what is left
of a count stays in the counter, so the error of a sum is bounded by one count and does not grow.

In the words of the convention sheet, measured = true + bias.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["ImuErrors", "RealisedErrors", "RealisedSensor", "SensorErrors", "apply", "gauss_markov", "quantised"]

FloatArray = NDArray[np.float64]
PerAxis = float | tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """Errors of three gyros (rad) or three accelerometers (m/s); each one number for all axes, or one for each.

    Attributes
    ----------
    bias, bias_sigma : rad/s or m/s^2
        A known part, and the deviation of the part that is drawn for each run.
    random_walk : rad/sqrt(s) or m/s/sqrt(s)
        Density of the white noise.
    markov_sigma : rad/s or m/s^2
        Deviation of the Gauss-Markov process.
    markov_time : s, > 0
        Its correlation time.
    scale_factor, scale_factor_sigma : 1
        A known part, and the deviation of the part that is drawn for each run.
    quantum : rad or m/s
        One count; 0: none.
    """

    bias: PerAxis = 0.0
    bias_sigma: PerAxis = 0.0
    random_walk: PerAxis = 0.0
    markov_sigma: PerAxis = 0.0
    markov_time: PerAxis = 1000.0
    scale_factor: PerAxis = 0.0
    scale_factor_sigma: PerAxis = 0.0
    quantum: PerAxis = 0.0


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """Errors of the gyros and of the accelerometers."""

    gyro: SensorErrors = field(default_factory=SensorErrors)
    accel: SensorErrors = field(default_factory=SensorErrors)


@dataclass(frozen=True, slots=True)
class RealisedSensor:
    """What was drawn for a triad.

    Attributes
    ----------
    constant_bias : (..., 3) array, rad/s or m/s^2
    markov : (..., N, 3) array, rad/s or m/s^2
        The Gauss-Markov process over each interval.
    scale_factor : (..., 3) array
    """

    constant_bias: FloatArray
    markov: FloatArray
    scale_factor: FloatArray

    @property
    def bias(self) -> FloatArray:
        """Constant and Gauss-Markov part together, (..., N, 3)."""
        return self.constant_bias[..., None, :] + self.markov


@dataclass(frozen=True, slots=True)
class RealisedErrors:
    """The truth about the errors of a run, or of runs."""

    gyro: RealisedSensor
    accel: RealisedSensor


def apply(
    increments: ArrayLike, period: float, rng: np.random.Generator, errors: ImuErrors
) -> tuple[FloatArray, RealisedErrors]:
    """Increments as the IMU would measure them, and the truth about its errors.

    Parameters
    ----------
    increments : (..., N, 6) array
        True dtheta (rad) and dvel (m/s) in b over N intervals; every leading axis is a run of its own.
    period : float, s
    rng : Generator
        All chance comes from its children, one for each kind of error: an error that is switched off leaves the others as they
        were, and the record of a run begins as a shorter one of the same seed.
    errors : ImuErrors

    Returns
    -------
    measured : (..., N, 6) array
    realised : RealisedErrors
    """
    u = np.asarray(increments, dtype=float)
    of_gyro, of_accel = rng.spawn(2)
    dtheta, gyro = _measured(u[..., :3], period, of_gyro, errors.gyro)
    dvel, accel = _measured(u[..., 3:], period, of_accel, errors.accel)
    return np.concatenate([dtheta, dvel], axis=-1), RealisedErrors(gyro, accel)


def _measured(
    u: FloatArray, period: float, rng: np.random.Generator, e: SensorErrors
) -> tuple[FloatArray, RealisedSensor]:
    runs = (*u.shape[:-2], 3)
    of_run, of_drift, of_noise = rng.spawn(3)
    bias = np.asarray(e.bias) + np.asarray(e.bias_sigma) * of_run.standard_normal(runs)
    scale = np.asarray(e.scale_factor) + np.asarray(e.scale_factor_sigma) * of_run.standard_normal(runs)
    fraction = of_run.uniform(-0.5, 0.5, runs)
    markov = gauss_markov(of_drift.standard_normal(u.shape), period, e.markov_sigma, e.markov_time)
    white = np.asarray(e.random_walk) * np.sqrt(period) * of_noise.standard_normal(u.shape)
    real = RealisedSensor(bias, markov, scale)
    total = (1.0 + scale[..., None, :]) * u + real.bias * period + white
    return quantised(total, np.broadcast_to(np.asarray(e.quantum, dtype=float), 3), fraction), real


def gauss_markov(noise: FloatArray, period: float, sigma: PerAxis, time: PerAxis) -> FloatArray:
    """A stationary first-order Gauss-Markov process (..., N, 3) out of standard normal numbers of that shape.

    x_0 = sigma n_0, x_k+1 = a x_k + sigma sqrt(1 - a^2) n_k+1, a = exp(-period / time).
    """
    deviation, tau = (
        np.broadcast_to(np.asarray(sigma, dtype=float), 3),
        np.broadcast_to(np.asarray(time, dtype=float), 3),
    )
    out = np.zeros(noise.shape)
    if not deviation.any():
        return out
    from scipy.signal import lfilter  # slow to import, and most runs do not need it

    for axis in np.flatnonzero(deviation):
        decay = np.exp(-period / tau[axis])
        driven = noise[..., axis] * np.sqrt(-np.expm1(-2.0 * period / tau[axis]))
        driven[..., :1] = noise[..., :1, axis]
        out[..., axis] = deviation[axis] * lfilter([1.0], [1.0, -decay], driven, axis=-1)
    return out


def quantised(increments: FloatArray, quantum: FloatArray, fraction: FloatArray) -> FloatArray:
    """Whole counts of increments (..., N, 3); the counter keeps the rest, and starts with ``fraction`` of a count (..., 3)."""
    out = increments.copy()
    for axis in np.flatnonzero(quantum):
        total = np.cumsum(increments[..., axis], axis=-1) / quantum[axis] + fraction[..., None, axis]
        out[..., axis] = quantum[axis] * np.diff(np.round(total), axis=-1, prepend=0.0)
    return out
