"""The frame of a local-level INS."""

from __future__ import annotations

from estimfw.model.frame import Frame

__all__ = ["LEVEL"]

#: East, North, Up at the vehicle: the true geographic frame.
LEVEL = Frame("t", ("E", "N", "U"))
