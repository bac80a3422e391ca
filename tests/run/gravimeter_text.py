"""The gravimeter's alignment by generic blocks and couplings alone (the specification of its alignment, section 1)."""

from __future__ import annotations

import math

__all__ = ["gravimeter"]

RATE, RADIUS, GRAVITY, LATITUDE = 7.292115e-5, 6371000.0, 9.80665, math.radians(39.1)


def gravimeter(alpha: float, duration: int = 1200, estimator: str = "{kind: kalman}") -> str:
    """The config, with the platform's axes turned by ``alpha`` (deg) from East and North."""
    ca, sa = math.cos(math.radians(alpha)), math.sin(math.radians(alpha))
    up, north = RATE * math.sin(LATITUDE), RATE * math.cos(LATITUDE)
    turn = [[ca, -sa], [sa, ca]]
    terms = {
        "coriolis": ("velocity_error", "velocity_error", [[0.0, 2 * up], [-2 * up, 0.0]]),
        "gravity_tilt": ("velocity_error", "tilt", [[0.0, -GRAVITY], [GRAVITY, 0.0]]),
        "accel_coupling": ("velocity_error", "accel_bias", turn),
        "earth_rate": ("tilt", "tilt", [[0.0, up], [-up, 0.0]]),
        "azimuth_tilt": ("tilt", "azimuth", [[-north], [0.0]]),
        "transport": ("tilt", "velocity_error", [[0.0, -1.0 / RADIUS], [1.0 / RADIUS, 0.0]]),
        "drift_coupling": ("tilt", "drift", turn),
        "tilt_azimuth": ("azimuth", "tilt", [[north, 0.0]]),
        "transport_azimuth": ("azimuth", "velocity_error", [[math.tan(LATITUDE) / RADIUS, 0.0]]),
        "azimuth_drift_coupling": ("azimuth", "azimuth_drift", [[1.0]]),
    }
    process = "\n".join(
        f"  {name}: {{kind: couple, target: {target}, source: {source}, coefficient: {matrix}}}"
        for name, (target, source, matrix) in terms.items()
    )
    return f"""\
estimfw: 1
name: gravimeter alignment
blocks:
  velocity_error: {{kind: random_walk, unit: m/s, axes: [x, y], sigma: 0.1 m/s, noise: 5 ug/sqrt(Hz)}}
  tilt: {{kind: random_walk, unit: rad, axes: [x, y], sigma: 0.1 deg, noise: 0.001 deg/sqrt(h)}}
  azimuth: {{kind: random_walk, unit: rad, sigma: 1 deg, noise: 0.001 deg/sqrt(h)}}
  accel_bias: {{kind: random_constant, unit: m/s^2, axes: [x, y], sigma: 50 ug}}
  drift: {{kind: random_constant, unit: rad/s, axes: [x, y], sigma: 0.02 deg/h}}
  azimuth_drift: {{kind: random_constant, unit: rad/s, sigma: 0.02 deg/h}}
process:
{process}
measurements:
  velocity: {{kind: direct, of: [{{block: velocity_error}}], noise: 0.01 m/s}}
estimator: {estimator}
source: {{kind: simulate_model, duration: {duration} s, rate: 1 Hz, seed: 3}}
"""
