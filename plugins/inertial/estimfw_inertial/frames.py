"""The frames of inertial navigation, as the model language has them."""

from __future__ import annotations

from estimfw.model.frame import Frame

__all__ = ["BODY", "NAVIGATION"]

#: East, North, Up.
NAVIGATION = Frame("n", ("E", "N", "U"))
#: Right, forward, up, fixed to the IMU; ``C_bn`` takes a vector from b to n, ``omega_nb_n`` is its rate against n, in n.
BODY = Frame("b", ("R", "F", "U"), parent="n", rotation="C_bn", rate="omega_nb_n")
