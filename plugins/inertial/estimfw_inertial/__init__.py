r"""Inertial navigation for estimfw. This is the convention sheet of the package and of the plugins that build on it.

Frames
------
* ``n``: East, North, Up at the vehicle.
* ``b``: right (x), forward (y), up (z), fixed to the vehicle.
* ``e``, ``i``: fixed to the Earth, and inertial.

Vectors carry their frame in the name, ``v_n``. ``C_bn`` takes a vector from b to n: ``v_n = C_bn v_b``.
``omega_ie_n`` is the rate of e against i, resolved in n; ``omega_nb_n`` is the rate of b against n, in n.

Attitude
--------
``C_bn = Rz(yaw) Rx(pitch) Ry(roll)``, elementary rotations positive by the right-hand rule:

* yaw, counter-clockwise about Up, -180 .. 180 deg; 0: forward is North, -90 deg: forward is East;
* pitch, about x, -90 .. 90 deg; positive: the nose is up;
* roll, about y, -180 .. 180 deg; positive: the right side is down;
* heading, clockwise from North, 0 .. 360 deg: ``heading = -yaw``.

A rotation vector ``v`` has the matrix ``exp([v x])``; ``[v x] u`` is the cross product of v and u.

Errors
------
* attitude: computed ``C_bn = (I - [phi x])`` true ``C_bn``, finite ``exp(-[phi x])``; phi in n, rad;
* velocity: ``dV = V_mech - V``, computed minus true, in n, m/s;
* sensors: measured = true + bias. Gyro biases in rad/s, accelerometer biases in m/s^2, in b.

Gravity and specific force
--------------------------
Gravity is (0, 0, -g) in n. An accelerometer senses specific force, acceleration minus gravitation; at rest (0, 0, +g) in n.

IMU samples
-----------
``dtheta`` (rad) is the integral over a sampling interval of the rate of b against i, ``dvel`` (m/s) that of specific force;
both in b. A time stamp is the *end* of the interval. Everything is in SI: rad, m, s.
"""

from __future__ import annotations

__all__: list[str] = []
