"""Angles without jumps: a yaw that crosses 180 deg is one curve, and its truth lies beside it."""

from __future__ import annotations

import numpy as np

from estimfw.data.record import FloatArray

__all__ = ["beside", "unwrapped", "wrapped"]

TURN = 2 * np.pi


def wrapped(angle: FloatArray) -> FloatArray:
    """The same angles in [-pi, pi), rad."""
    turned: FloatArray = (angle + np.pi) % TURN - np.pi
    return turned


def unwrapped(angle: FloatArray) -> FloatArray:
    """The same angles (N,), rad, without jumps of whole turns; the last known one is as given. NaN stays."""
    result = angle.copy()
    known = np.isfinite(angle)
    if known.any():
        smooth = np.unwrap(angle[known])
        result[known] = smooth - smooth[-1] + angle[known][-1]
    return result


def beside(angle: FloatArray, reference: FloatArray) -> FloatArray:
    """The same angles (N,), rad, moved by whole turns to where the reference is; unmoved where that is unknown."""
    moved: FloatArray = reference + wrapped(angle - reference)
    return np.where(np.isfinite(reference), moved, angle)
