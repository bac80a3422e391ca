r"""Alignment of an azimuth strapdown platform gravimeter: a two-axis platform that is held level, with a third gyro in azimuth.

Frames
------
* ``n``: East, North, Up.
* ``p``: x, y, z of the platform, ``n`` turned by the computed angle alpha about Up, anticlockwise seen from above: alpha is the
  angle from East to x, and from North to y; a clockwise heading of y is ``-alpha``. ``C_pn`` takes a vector from p to n.

Errors
------
* dV = computed velocity minus true, in n, m/s. A standing base has V = 0, so that the computed velocity is its own error.
* phi = the rotation vector from the computed platform to the real one, in n, rad: real ``C_pn = exp([phi x])`` computed ``C_pn``.
* dA = measured minus true specific force, in p, m/s^2, of the accelerometers x and y.
* eps = the rate at which the platform really turns minus the commanded one, in p, rad/s. It is what its gyros *fail* to measure:
  measured = true - eps, the opposite of the sign of a gyro bias in `estimfw_inertial`.

Error model on a standing base at a known place of a spherical Earth (radius R, latitude L, g; W the Earth's rate)::

    dV'  = [f_n x] phi - 2 [omega_ie_n x] dV + C_pn (dA + eta_a)              f_n = (0, 0, g)
    phi' = -[omega_ie_n x] phi + (-dV_N, dV_E, tan L dV_E) / R + C_pn (eps + eta_g)
    dA'  = 0,  eps' = 0

Only what is horizontal of dV and dA is a state: the platform computes no vertical velocity, and its vertical accelerometer is the
gravity sensor.
"""

__all__: list[str] = []
