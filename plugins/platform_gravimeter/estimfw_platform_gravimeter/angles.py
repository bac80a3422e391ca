"""The output ``platform``: where the platform really stands, as far as the filter knows.

With R = exp([phi x]) C_pn and R = Rz(azimuth) Rx(tilt_x) Ry(tilt_y): ``azimuth`` is the angle from North to y, anticlockwise
seen from above (alpha and the azimuth error), ``tilt_x`` and ``tilt_y`` are turns about the platform's own axes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from estimfw_inertial.rotation import euler_angles, euler_jacobian, exponential
from numpy.typing import NDArray

from estimfw.model.coefficient import matrix
from estimfw.model.parts import DerivedVariable, Output

__all__ = ["PLATFORM_JACOBIAN", "angles_value", "platform_output"]

FloatArray = NDArray[np.float64]


def angles_value(estimates: Mapping[str, FloatArray], nominal: Mapping[str, FloatArray]) -> FloatArray:
    """Angles (..., 3) rad of exp([phi x]) C_pn; ``estimates`` holds one block, phi (..., 3) in n."""
    (phi,) = estimates.values()
    return euler_angles(exponential(phi) @ nominal["C_pn"])


def platform_jacobian(C_pn: FloatArray) -> FloatArray:
    """d(azimuth, tilt_x, tilt_y)/d(phi), (..., 3, 3)."""
    return euler_jacobian(C_pn)


PLATFORM_JACOBIAN = DerivedVariable("platform_jacobian", (3, 3), ("C_pn",), platform_jacobian)


def _truth(truth: Mapping[str, FloatArray]) -> FloatArray:
    return euler_angles(truth["C_pn"])


def platform_output(block: str) -> Output:
    """The output for an attitude-error block in n."""
    return Output(
        name="platform",
        components=("azimuth", "tilt_x", "tilt_y"),
        units=("rad",) * 3,
        display_units=("deg", "arcmin", "arcmin"),
        value=angles_value,
        jacobian=((block, matrix("platform_jacobian"), "n"),),
        needs=("C_pn",),
        truth=_truth,
        period=2.0 * np.pi,
    )
