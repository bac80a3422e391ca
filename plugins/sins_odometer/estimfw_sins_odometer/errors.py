"""The true attitude error, where the truth is known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from estimfw_inertial.rotation import exponential
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

__all__ = ["attitude_error_of"]

FloatArray = NDArray[np.float64]


def attitude_error_of(nominal: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]) -> FloatArray:
    """phi of true C_ni = exp([phi x]) C_ni, (..., 3) rad in i.

    Wherever the filter started: the true C_bi is the computed one without what the true gyro bias did to it, to first order.
    """
    turned = nominal["accel_sensitivity"] @ np.asarray(truth["gyro_bias_b"])[..., None]
    C_bi = exponential(-turned[..., 0]) @ nominal["C_bi"]
    relative = C_bi @ np.swapaxes(truth["C_bn"], -1, -2) @ np.swapaxes(nominal["C_ni"], -1, -2)
    return Rotation.from_matrix(relative.reshape(-1, 3, 3)).as_rotvec().reshape(relative.shape[:-1])
