r"""The output ``attitude``: yaw, pitch, roll and heading of the corrected attitude.

With R = exp([phi x]) C_bn and R = Rz(yaw) Rx(pitch) Ry(roll)::

    yaw = atan2(-R01, R11), pitch = asin(R21), roll = atan2(-R20, R22), heading = -yaw

Its Jacobian to phi is `estimfw_inertial.rotation.euler_jacobian`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from estimfw_inertial.rotation import euler_jacobian
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.model.coefficient import matrix
from estimfw.model.parts import DerivedVariable, Output

__all__ = ["ATTITUDE_JACOBIAN", "attitude_jacobian", "attitude_output", "attitude_value", "euler_of"]

FloatArray = NDArray[np.float64]


def euler_of(C_bn: FloatArray) -> FloatArray:
    """yaw (-pi..pi), pitch, roll, heading (0..2 pi) in rad, (..., 4), of C_bn (..., 3, 3)."""
    yaw = np.arctan2(-C_bn[..., 0, 1], C_bn[..., 1, 1])
    pitch = np.arcsin(np.clip(C_bn[..., 2, 1], -1.0, 1.0))
    roll = np.arctan2(-C_bn[..., 2, 0], C_bn[..., 2, 2])
    return np.stack([yaw, pitch, roll, np.mod(-yaw, 2.0 * np.pi)], axis=-1)


def attitude_value(estimates: Mapping[str, FloatArray], nominal: Mapping[str, FloatArray]) -> FloatArray:
    """Angles (..., 4) of exp([phi x]) C_bn; ``estimates`` holds one block, phi (..., 3) in n."""
    (phi,) = estimates.values()
    turn = Rotation.from_rotvec(phi.reshape(-1, 3)).as_matrix().reshape((*phi.shape, 3))
    return euler_of(turn @ nominal["C_bn"])


def attitude_jacobian(C_bn: FloatArray) -> FloatArray:
    """d(yaw, pitch, roll, heading)/d(phi), (..., 4, 3)."""
    angles = euler_jacobian(C_bn)
    return np.concatenate([angles, -angles[..., :1, :]], axis=-2)


ATTITUDE_JACOBIAN = DerivedVariable("attitude_jacobian", (4, 3), ("C_bn",), attitude_jacobian)


def _truth(truth: Mapping[str, FloatArray]) -> FloatArray:
    return euler_of(truth["C_bn"])


def attitude_output(block: str) -> Output:
    """The output for an attitude-error block in n."""
    names = ("yaw", "pitch", "roll", "heading")
    return Output(
        name="attitude",
        components=names,
        units=("rad",) * 4,
        display_units=("deg",) * 4,
        value=attitude_value,
        jacobian=((block, matrix("attitude_jacobian", (4, 3)), "n"),),
        needs=("C_bn",),
        truth=_truth,
        period=2.0 * np.pi,
    )
