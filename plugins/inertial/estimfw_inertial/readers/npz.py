"""NumPy archives with the arrays ``t`` (s), ``dtheta`` (rad), ``dvel`` (m/s) and, if wanted, ``dt`` (s).

Nothing is unpickled, and nothing is unpacked before the headers inside have told its size.
"""

from __future__ import annotations

import math
import zipfile
import zlib
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from estimfw.errors import DataError, Location
from estimfw_inertial.readers.imu_log import ImuLog, imu_stream
from estimfw_inertial.readers.layout import CsvLayout

__all__ = ["LARGEST", "read"]

FloatArray = NDArray[np.float64]

#: Bytes that one archive may unpack to: 5 hours at 1 kHz.
LARGEST = 1 << 30
_NEEDED = ("t", "dtheta", "dvel")


def read(path: Path, layout: CsvLayout) -> ImuLog:
    """Read an archive; ``layout`` is not used.

    Raises
    ------
    DataError
        No archive or a damaged one, missing or odd arrays, pickled objects, an archive that unpacks to too much.
    """
    del layout
    arrays = _arrays(path)
    time, dtheta, dvel = (arrays[name] for name in _NEEDED)
    rows = time.shape[0] if time.ndim == 1 else -1
    if dtheta.shape != (rows, 3) or dvel.shape != (rows, 3):
        raise _fault(
            path,
            f"t has shape {time.shape}, dtheta {dtheta.shape}, dvel {dvel.shape}",
            "expected (N,), (N, 3) and (N, 3)",
        )
    if rows == 0:
        raise _fault(path, "the archive holds no samples")
    return ImuLog(imu_stream(time, dtheta, dvel, _period(path, arrays.get("dt"))))


def _period(path: Path, dt: FloatArray | None) -> float | None:
    if dt is None:
        return None
    if dt.size != 1 or not (math.isfinite(dt.item()) and dt.item() > 0.0):
        raise _fault(path, f"dt is {dt.tolist()}", "expected one positive number, the sampling interval in s")
    return float(dt.item())


def _arrays(path: Path) -> dict[str, FloatArray]:
    try:
        with zipfile.ZipFile(path) as archive:
            members = {name.removesuffix(".npy"): archive.getinfo(name) for name in archive.namelist()}
            _check_members(path, members)
            wanted = [name for name in (*_NEEDED, "dt") if name in members]
            return {name: _array(path, archive, members[name]) for name in wanted}
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as cause:
        raise _fault(
            path, f"not a readable NPZ archive: {cause}", "is the file cut off, or of another format?"
        ) from cause


def _check_members(path: Path, members: dict[str, zipfile.ZipInfo]) -> None:
    for name in _NEEDED:
        if name not in members:
            found = ", ".join(sorted(members)) or "none"
            raise _fault(
                path, f"the archive has no array {name!r}", f"arrays found: {found}; needed: {', '.join(_NEEDED)}"
            )
    size = sum(info.file_size for info in members.values())
    if size > LARGEST:
        hint = f"the limit is {LARGEST / 1e9:.3g} GB; cut the log into parts"
        raise _fault(path, f"the archive unpacks to {size / 1e9:.3g} GB", hint)


def _array(path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> FloatArray:
    """One array as float64, once its own header has been found sane."""
    with archive.open(info) as file:
        _check_header(path, info, file)
    with archive.open(info) as file:
        return np.asarray(npy.read_array(file, allow_pickle=False), dtype=np.float64)


def _check_header(path: Path, info: zipfile.ZipInfo, file: IO[bytes]) -> None:
    try:
        version = npy.read_magic(file)
        header = npy.read_array_header_1_0(file) if version == (1, 0) else npy.read_array_header_2_0(file)
    except ValueError as cause:
        raise _fault(path, f"{info.filename} is not a NumPy array: {cause}") from cause
    shape, _, dtype = header
    if dtype.hasobject:
        raise _fault(
            path, f"{info.filename} holds pickled Python objects", "they are never unpickled: save plain numbers"
        )
    if dtype.kind not in "fiu":
        raise _fault(path, f"{info.filename} holds {dtype}, not real numbers")
    expected = file.tell() + math.prod(shape) * dtype.itemsize
    if info.file_size != expected:
        raise _fault(
            path,
            f"{info.filename} has {info.file_size} bytes, its header promises {expected}",
            "the array is cut off or damaged",
        )


def _fault(path: Path, message: str, hint: str | None = None) -> DataError:
    return DataError(message, location=Location(str(path)), hint=hint)
