r"""The output ``attitude`` of in-motion alignment: yaw, pitch, roll and heading of the corrected attitude (K8).

With phi in i and the gyro bias eps in b, ``C_bn = C_ni^T exp(-[phi x]) exp(-[M_g eps x]) C_bi``. For small ones it is turned from
the left in n by ``-C_ni^T (phi + M_g eps)``, so its Jacobian is that of the angles times ``-C_ni^T`` and ``-C_ni^T M_g``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from estimfw_inertial.rotation import euler_angles, euler_jacobian, exponential, heading_of
from numpy.typing import NDArray

from estimfw.model.coefficient import matrix
from estimfw.model.parts import DerivedVariable, Output

__all__ = [
    "ATTITUDE_JACOBIAN",
    "angles_of",
    "angles_of_nominal",
    "attitude_jacobian",
    "attitude_output",
    "attitude_value",
    "determined_output",
]

FloatArray = NDArray[np.float64]

COMPONENTS = ("yaw", "pitch", "roll", "heading")


def angles_of(C_bn: FloatArray) -> FloatArray:
    """yaw (-pi..pi), pitch, roll, heading (0..2 pi) in rad, (..., 4), of C_bn (..., 3, 3)."""
    angles = euler_angles(C_bn)
    return np.concatenate([angles, heading_of(angles[..., :1])], axis=-1)


def attitude_value(estimates: Mapping[str, FloatArray], nominal: Mapping[str, FloatArray]) -> FloatArray:
    """Angles (..., 4); ``estimates`` holds phi (..., 3) in i, and behind it the gyro bias (..., 3) in b where there is one."""
    phi, *bias = estimates.values()
    C_bi = nominal["C_bi"]
    if bias:
        C_bi = exponential(-(nominal["accel_sensitivity"] @ bias[0][..., None])[..., 0]) @ C_bi
    return angles_of(np.swapaxes(exponential(phi) @ nominal["C_ni"], -1, -2) @ C_bi)


def attitude_jacobian(C_bn: FloatArray, C_ni: FloatArray) -> FloatArray:
    """d(yaw, pitch, roll, heading)/d(phi), (..., 4, 3)."""
    angles = -euler_jacobian(C_bn) @ np.swapaxes(C_ni, -1, -2)
    return np.concatenate([angles, -angles[..., :1, :]], axis=-2)


ATTITUDE_JACOBIAN = DerivedVariable("attitude_jacobian", (4, 3), ("C_bn", "C_ni"), attitude_jacobian)


def angles_of_nominal(estimates: Mapping[str, FloatArray], nominal: Mapping[str, FloatArray]) -> FloatArray:
    """Angles (..., 4) of a nominal that is the answer itself: a determination has no states."""
    del estimates
    return angles_of(nominal["C_bn"])


def true_angles(truth: Mapping[str, FloatArray]) -> FloatArray:
    """Angles (..., 4) of the true attitude."""
    return angles_of(truth["C_bn"])


def attitude_output(block: str, gyro_bias: str) -> Output:
    """The output for an attitude-error block in i and a gyro-bias block in b."""
    turn = matrix("attitude_jacobian", (4, 3))
    return Output(
        name="attitude",
        components=COMPONENTS,
        units=("rad",) * 4,
        display_units=("deg",) * 4,
        value=attitude_value,
        jacobian=((block, turn, "i"), (gyro_bias, turn @ matrix("accel_sensitivity"), "b")),
        needs=("C_bi", "C_ni", "accel_sensitivity"),
        truth=true_angles,
        period=2.0 * np.pi,
    )


def determined_output() -> Output:
    """The output of a provider whose ``C_bn`` is the answer."""
    return Output(
        name="attitude",
        components=COMPONENTS,
        units=("rad",) * 4,
        display_units=("deg",) * 4,
        value=angles_of_nominal,
        jacobian=(),
        needs=("C_bn",),
        truth=true_angles,
        period=2.0 * np.pi,
    )
