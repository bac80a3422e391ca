"""The frames of a levelled platform, as the model language has them."""

from __future__ import annotations

from estimfw_inertial.frames import NAVIGATION

from estimfw.model.frame import Frame

__all__ = ["NAVIGATION", "PLATFORM"]

#: Two level axes and the vertical of the platform; ``C_pn`` takes a vector from p to n. Turned at a few instants, if at all.
PLATFORM = Frame("p", ("x", "y", "z"), parent="n", rotation="C_pn")
