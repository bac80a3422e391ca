r"""Errors of a local-level INS on a moving base. This is the convention sheet of the package.

* ``t``: the true geographic frame, East, North, Up. The height is 0, and so is the vertical velocity.
* ``p``: the platform. The attitude error is the small rotation vector phi = (alpha, beta, gamma) from t to p, rad in t:
  ``C_t^p = I - [phi x]``. gamma, about Up, is positive anticlockwise seen from above.
* Errors are INS minus truth: dV (m/s, East and North), dphi (latitude, rad), dlam (longitude, rad).
* The platform is *gimballed*: a gyro drift eps turns it, and adds to phi' with +. (For a strapdown analytic platform with
  the same phi the sign is -.) An accelerometer bias dA adds to dV' with +. Both are along the axes of the platform, which
  are those of t to first order.
* A heading K is clockwise from North, 0 .. 360 deg: Vx = V sin K, Vy = V cos K, and K_INS - K = +gamma.
* Vehicle axes: right, forward. The stream ``ins`` has the columns latitude, velocity_E, velocity_N, heading, and longitude
  where it is used.
* Earth: WGS-84, rate 7.292115e-5 rad/s, gravity 9.80665 m/s^2 unless a config says another.

Equation numbers are those of Wu, Tsang and Nie; (1) is their error model, checked term by term against the exact platform
equations.
"""

from __future__ import annotations

__all__: list[str] = []
