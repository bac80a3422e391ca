"""What a reader hands over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Stream
from estimfw_inertial.increments import IMU_COLUMNS

__all__ = ["ImuLog", "imu_stream"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ImuLog:
    """A log as it stands in its file.

    Attributes
    ----------
    stream : Stream
        ``imu``, increments, in the order of the file: times may go backwards or repeat. Its period is None where the file
        does not say it.
    initial : mapping of str to array
        What the header says of the start: ``C_bn`` (3, 3), ``velocity_n`` (3,) m/s.
    header : mapping
        Other facts of the header, JSON values in SI: ``latitude``, ``longitude`` (rad), ``height`` (m).
    lines : (N,) int array or None
        Line of each row in a text file, from 1.
    """

    stream: Stream
    initial: Mapping[str, FloatArray] = field(default_factory=dict)
    header: Mapping[str, float] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None


def imu_stream(time: FloatArray, dtheta: FloatArray, dvel: FloatArray, period: float | None) -> Stream:
    """The stream ``imu`` from (N,) s, (N, 3) rad and (N, 3) m/s; infinities become NaN."""
    values = np.hstack([dtheta, dvel])
    values[~np.isfinite(values)] = np.nan
    return Stream("imu", time, values, IMU_COLUMNS, kind="increment", period=period)
