"""One writer at a time for an output: a folder, or a file beside those of others.

The lock belongs to an open file, not to the file's existence: a killed process leaves no stale lock.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from estimfw.errors import DataError, Location

__all__ = ["LOCK_NAME", "file_lock", "folder_lock", "lock_of_file"]

LOCK_NAME = ".estimfw.lock"

if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Hold a folder for writing; released at the end of the ``with`` block, or when the process dies.

    Raises
    ------
    DataError
        Another writer (of this process or of another one) holds it, or the folder cannot be written.
    """
    with _lock_at(folder / LOCK_NAME, folder, "another run is writing into this folder", "name another output folder"):
        yield


@contextmanager
def file_lock(path: Path) -> Iterator[None]:
    """The same for one file, whichever way its path is spelled; its folder stays free for other outputs.

    Raises
    ------
    DataError
        Another writer holds it, or its folder cannot be written.
    """
    with _lock_at(lock_of_file(path.resolve()), path, "another run is writing this file", "name another output"):
        yield


def lock_of_file(path: Path) -> Path:
    """Where the lock of a file lies: beside it. ``path`` is resolved."""
    return path.with_name(f".{path.name}{LOCK_NAME}")


@contextmanager
def _lock_at(path: Path, output: Path, taken: str, way_out: str) -> Iterator[None]:
    descriptor = _acquire(path, output, taken, way_out)
    try:
        yield
    finally:
        with suppress(OSError):  # while still locked, so that nobody can be waiting on this file
            path.unlink()
        os.close(descriptor)


def _acquire(path: Path, output: Path, taken: str, way_out: str) -> int:
    while True:
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as fault:
            raise DataError(f"cannot write: {fault.strerror}", location=Location(str(output))) from fault
        try:
            _lock(descriptor)
        except OSError as fault:
            os.close(descriptor)
            raise DataError(
                taken,
                location=Location(str(output)),
                hint=f"wait for it to end, or {way_out}",
            ) from fault
        if _still_named(path, descriptor):
            return descriptor
        os.close(descriptor)  # the last holder took the file away between our open and our lock


def _still_named(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
