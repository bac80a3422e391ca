"""The true errors, where the truth is known: of the nominal, that is of the recorded INS less what it was corrected by.

A platform's tilt cannot be read from what an INS records; a simulation tells it as the truth ``attitude_error_t``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

__all__ = ["attitude_error_of", "latitude_error_of", "longitude_error_of", "velocity_error_of"]

FloatArray = NDArray[np.float64]
Values = Mapping[str, FloatArray]


def attitude_error_of(nominal: Values, truth: Values) -> FloatArray:
    """phi (..., 3) rad in t: that of the recorded platform less the correction."""
    return np.asarray(truth["attitude_error_t"] - nominal["attitude_correction"])


def velocity_error_of(nominal: Values, truth: Values) -> FloatArray:
    """dV (..., 3) m/s in t; the vertical one is held at 0."""
    horizontal = nominal["velocity_t"] - truth["velocity_t"]
    return np.concatenate([horizontal, np.zeros_like(horizontal[..., :1])], axis=-1)


def latitude_error_of(nominal: Values, truth: Values) -> FloatArray:
    """dphi (..., 1) rad."""
    return np.asarray(nominal["latitude"] - truth["latitude"])[..., None]


def longitude_error_of(nominal: Values, truth: Values) -> FloatArray:
    """dlam (..., 1) rad, the shorter way round."""
    difference = np.asarray(nominal["longitude"] - truth["longitude"])
    return np.asarray(np.pi - np.mod(np.pi - difference, 2.0 * np.pi))[..., None]
