"""Presets: errors that are typical of a class of IMU. Round numbers of the middle of each class, not those of a product.

Biases and scale factors are deviations of what is drawn for a run. ``ring_laser`` is what the demonstration of the public record
``lasergyro`` (PSINS toolbox) assumes of its unit, with the resolution found in the record.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from estimfw_inertial.imu_errors import ImuErrors, SensorErrors

__all__ = ["GRADES"]

_DEG = float(np.radians(1.0))
_DEG_PER_H = _DEG / 3600.0
_DEG_PER_SQRT_H = _DEG / 60.0
_ARCSEC = _DEG / 3600.0
_UG = 9.80665e-6
_PPM = 1e-6

GRADES: Mapping[str, ImuErrors] = MappingProxyType({
    "navigation": ImuErrors(
        gyro=SensorErrors(bias_sigma=0.01 * _DEG_PER_H, random_walk=0.002 * _DEG_PER_SQRT_H, scale_factor_sigma=5.0 * _PPM),
        accel=SensorErrors(bias_sigma=50.0 * _UG, random_walk=10.0 * _UG, scale_factor_sigma=100.0 * _PPM),
    ),
    "ring_laser": ImuErrors(
        gyro=SensorErrors(bias_sigma=0.03 * _DEG_PER_H, random_walk=0.001 * _DEG_PER_SQRT_H, quantum=0.1 * _ARCSEC),
        accel=SensorErrors(bias_sigma=100.0 * _UG, random_walk=10.0 * _UG, quantum=125e-6 * 9.780327),
    ),
    "tactical": ImuErrors(
        gyro=SensorErrors(
            bias_sigma=1.0 * _DEG_PER_H, random_walk=0.1 * _DEG_PER_SQRT_H,
            markov_sigma=0.3 * _DEG_PER_H, markov_time=300.0, scale_factor_sigma=150.0 * _PPM,
        ),
        accel=SensorErrors(
            bias_sigma=1000.0 * _UG, random_walk=50.0 * _UG,
            markov_sigma=50.0 * _UG, markov_time=300.0, scale_factor_sigma=300.0 * _PPM,
        ),
    ),
    "industrial": ImuErrors(
        gyro=SensorErrors(
            bias_sigma=200.0 * _DEG_PER_H, random_walk=0.3 * _DEG_PER_SQRT_H,
            markov_sigma=10.0 * _DEG_PER_H, markov_time=200.0, scale_factor_sigma=3000.0 * _PPM,
        ),
        accel=SensorErrors(
            bias_sigma=5000.0 * _UG, random_walk=100.0 * _UG,
            markov_sigma=100.0 * _UG, markov_time=200.0, scale_factor_sigma=3000.0 * _PPM,
        ),
    ),
})  # fmt: skip
