"""NumPy archives with the arrays ``t`` (s), ``dtheta`` (rad), ``dvel`` (m/s) and, if wanted, ``dt`` (s)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimfw.data.readers.npz_arrays import npz_fault, read_arrays
from estimfw_inertial.readers.imu_log import ImuLog, imu_stream
from estimfw_inertial.readers.layout import CsvLayout

__all__ = ["LARGEST", "read"]

FloatArray = NDArray[np.float64]

#: Bytes that one archive may unpack to: 5 hours at 1 kHz.
LARGEST = 1 << 30
_NEEDED = ("t", "dtheta", "dvel")


def read(path: Path, layout: CsvLayout) -> ImuLog:
    """Read an archive; ``layout`` is not used. See `estimfw.data.readers.npz_arrays`.

    Raises
    ------
    DataError
        No archive or a damaged one, missing or odd arrays, pickled objects, an archive that unpacks to too much.
    """
    del layout
    arrays = read_arrays(path, _NEEDED, ("dt",), LARGEST)
    time, dtheta, dvel = (arrays[name] for name in _NEEDED)
    rows = time.shape[0] if time.ndim == 1 else -1
    if dtheta.shape != (rows, 3) or dvel.shape != (rows, 3):
        raise npz_fault(
            path,
            f"t has shape {time.shape}, dtheta {dtheta.shape}, dvel {dvel.shape}",
            "expected (N,), (N, 3) and (N, 3)",
        )
    if rows == 0:
        raise npz_fault(path, "the archive holds no samples")
    return ImuLog(imu_stream(time, dtheta, dvel, _period(path, arrays.get("dt"))))


def _period(path: Path, dt: FloatArray | None) -> float | None:
    if dt is None:
        return None
    if dt.size != 1 or not (math.isfinite(dt.item()) and dt.item() > 0.0):
        raise npz_fault(path, f"dt is {dt.tolist()}", "expected one positive number, the sampling interval in s")
    return float(dt.item())
