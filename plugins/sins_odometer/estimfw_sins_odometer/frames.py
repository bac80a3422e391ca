"""The frames of in-motion alignment: everything hangs below i, the body axes at the start."""

from __future__ import annotations

from estimfw.model.frame import Frame

__all__ = ["BODY", "INERTIAL", "NAVIGATION"]

#: The body axes at the start, held in inertial space.
INERTIAL = Frame("i", ("x", "y", "z"))
#: Right, forward, up.
BODY = Frame("b", ("R", "F", "U"), parent="i", rotation="C_bi", rate="omega_ib_i")
#: East, North, Up at the vehicle.
NAVIGATION = Frame("n", ("E", "N", "U"), parent="i", rotation="C_ni", rate="omega_in_i")
