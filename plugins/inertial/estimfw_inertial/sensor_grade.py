"""How good the sensors of an IMU are: what an alignment needs to say how good its answer is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["SensorGrade"]


@dataclass(frozen=True, slots=True)
class SensorGrade:
    """One sigma of each axis; the defaults are a navigation-grade laser gyro unit.

    Attributes
    ----------
    gyro_bias : float, rad/s
        0.03 deg/h.
    accel_bias : float, m/s^2
        100 ug.
    angle_random_walk : float, rad/sqrt(s)
        0.001 deg/sqrt(h).
    velocity_random_walk : float, m/s/sqrt(s)
        10 ug/sqrt(Hz).
    """

    gyro_bias: float = float(np.radians(0.03 / 3600.0))
    accel_bias: float = 100e-6 * 9.80665
    angle_random_walk: float = float(np.radians(0.001) / 60.0)
    velocity_random_walk: float = 10e-6 * 9.80665
