"""Arrays of a NumPy archive: nothing is unpickled, and nothing is unpacked before the headers inside have told its size."""

from __future__ import annotations

import math
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from estimfw.errors import DataError, Location

__all__ = ["LARGEST", "array_names", "npz_fault", "read_arrays"]

FloatArray = NDArray[np.float64]

#: Bytes that one archive may unpack to.
LARGEST = 1 << 30


def read_arrays(
    path: Path, needed: Sequence[str], wanted: Sequence[str] = (), largest: int = LARGEST
) -> dict[str, FloatArray]:
    """The named arrays as float64.

    Parameters
    ----------
    path : Path
    needed, wanted : sequence of str
        Arrays that must be there, and those that may be.
    largest : int
        Bytes that the archive may unpack to.

    Raises
    ------
    DataError
        No archive or a damaged one, missing or odd arrays, pickled objects, an archive that unpacks to too much.
    """
    with _opened(path) as archive:
        members = {name.removesuffix(".npy"): archive.getinfo(name) for name in archive.namelist()}
        _check_members(path, members, needed, largest)
        return {name: _array(path, archive, members[name]) for name in (*needed, *wanted) if name in members}


def array_names(path: Path) -> frozenset[str]:
    """The names of the arrays; DataError where the file is no archive."""
    with _opened(path) as archive:
        return frozenset(name.removesuffix(".npy") for name in archive.namelist())


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as cause:
        raise npz_fault(
            path,
            f"not a readable NPZ archive: {str(cause)[:100]} (the file ends at byte {path.stat().st_size})",
            "is the file cut off, or of another format?",
        ) from cause


def npz_fault(path: Path, message: str, hint: str | None = None) -> DataError:
    """An error about the archive as a whole."""
    return DataError(message, location=Location(str(path)), hint=hint)


def _check_members(path: Path, members: dict[str, zipfile.ZipInfo], needed: Sequence[str], largest: int) -> None:
    for name in needed:
        if name not in members:
            found = ", ".join(sorted(members)) or "none"
            raise npz_fault(
                path, f"the archive has no array {name!r}", f"arrays found: {found}; needed: {', '.join(needed)}"
            )
    size = sum(info.file_size for info in members.values())
    if size > largest:
        hint = f"the limit is {largest / 1e9:.3g} GB; cut the log into parts"
        raise npz_fault(path, f"the archive unpacks to {size / 1e9:.3g} GB", hint)


def _array(path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> FloatArray:
    """One array as float64, once its own header has been found sane."""
    with archive.open(info) as file:
        _check_header(path, info, file)
    with archive.open(info) as file:
        return np.asarray(npy.read_array(file, allow_pickle=False), dtype=np.float64)


def _check_header(path: Path, info: zipfile.ZipInfo, file: IO[bytes]) -> None:
    name = f"{info.filename} (at byte {info.header_offset})"
    try:
        version = npy.read_magic(file)
        header = npy.read_array_header_1_0(file) if version == (1, 0) else npy.read_array_header_2_0(file)
    except ValueError:
        raise npz_fault(
            path, f"{name} is not a NumPy array: its header cannot be read", "the file is damaged"
        ) from None
    shape, _, dtype = header
    if dtype.hasobject:
        raise npz_fault(
            path, f"{info.filename} holds pickled Python objects", "they are never unpickled: save plain numbers"
        )
    if dtype.kind not in "fiu":
        raise npz_fault(path, f"{info.filename} holds {dtype}, not real numbers")
    expected = file.tell() + math.prod(shape) * dtype.itemsize
    if info.file_size != expected:
        raise npz_fault(
            path,
            f"{info.filename} has {info.file_size} bytes, its header promises {expected}",
            "the array is cut off or damaged",
        )
