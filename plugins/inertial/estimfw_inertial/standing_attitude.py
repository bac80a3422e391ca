"""What a coarse alignment finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.model.nominal import Share

__all__ = ["StandingAttitude"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StandingAttitude:
    """The attitude of a standing vehicle and how well it is known.

    Attributes
    ----------
    C_bn : (3, 3) array
        Takes a vector from b to n.
    covariance : (3, 3) array, rad^2
        Of phi in n, where the found attitude is ``exp(-[phi x])`` times the true one.
    shares : mapping of str to Share
        What of it the biases cause (``accel_bias``, ``gyro_bias``, in b).
    time : float, s
        The instant at which it holds: the end of the window.
    disturbance : float, m/s
        Root mean square of the velocity that a still base would not have (3-D).
    """

    C_bn: FloatArray
    covariance: FloatArray
    shares: Mapping[str, Share]
    time: float
    disturbance: float
