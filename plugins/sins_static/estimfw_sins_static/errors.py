"""The true errors of a mechanization, where the truth is known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

__all__ = ["attitude_error_of", "velocity_error_of"]

FloatArray = NDArray[np.float64]


def velocity_error_of(nominal: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]) -> FloatArray:
    """dV = V_mech - V, (..., 3) m/s in n."""
    return np.asarray(nominal["velocity_n"] - truth["velocity_n"], dtype=float)


def attitude_error_of(nominal: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]) -> FloatArray:
    """phi of computed C_bn = exp(-[phi x]) C_bn, (..., 3) rad in n."""
    relative = truth["C_bn"] @ np.swapaxes(nominal["C_bn"], -1, -2)
    flat = np.broadcast_to(relative, nominal["C_bn"].shape).reshape(-1, 3, 3)
    return Rotation.from_matrix(flat).as_rotvec().reshape(nominal["C_bn"].shape[:-1])
