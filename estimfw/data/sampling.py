"""Do time stamps lie as far apart as the sensor's rate says?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import DataError, Location

__all__ = ["check_rate"]

FloatArray = NDArray[np.float64]


def check_rate(time: FloatArray, period: float, location: Location | None = None) -> None:
    """The median step of the time stamps (N,) s is the nominal sampling interval.

    Raises
    ------
    DataError
        It is not, to 10 %, with a guess at the unit.
    """
    if time.size < 2:
        return
    step = float(np.median(np.diff(time)))
    if abs(step - period) <= 0.1 * period:
        return
    for factor, unit in ((1e3, "ms"), (1e6, "us"), (1e9, "ns"), (1.0 / 60.0, "min")):
        if abs(step / (factor * period) - 1.0) < 0.1:
            raise DataError(
                f"the time stamps are {step:.6g} s apart, the sampling interval is {period:.6g} s: time in {unit}, not in s?",
                location=location,
                hint=f"say the unit of time ({unit}), or correct the log by the factor {1.0 / factor:g}",
            )
    raise DataError(
        f"the time stamps are {step:.6g} s apart ({1.0 / step:.6g} Hz), the sampling interval is {period:.6g} s "
        f"({1.0 / period:.6g} Hz)",
        location=location,
        hint="correct `rate`, or the log",
    )
