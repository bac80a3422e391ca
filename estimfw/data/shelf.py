"""Arrays laid down one after the other and taken back the last one first: in memory, and beyond a limit in a temporary file."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from types import TracebackType
from typing import IO, Self

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import DataError

__all__ = ["Shelf"]

FloatArray = NDArray[np.float64]
Arrays = tuple[FloatArray, ...]

#: Bytes that stay in memory.
IN_MEMORY = 1 << 28


@dataclass(frozen=True, slots=True)
class _Filed:
    place: int
    shapes: tuple[tuple[int, ...], ...]


class Shelf:
    """A stack of tuples of float arrays.

    Parameters
    ----------
    in_memory : int
        Bytes that stay in memory; what comes after them goes into a temporary file without a name, which is gone with the
        process, however that ends.
    """

    def __init__(self, in_memory: int = IN_MEMORY) -> None:
        self._limit, self._used = in_memory, 0
        self._kept: list[Arrays | _Filed] = []
        self._file: IO[bytes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._kept.clear()
        if self._file is not None:
            self._file.close()

    def __len__(self) -> int:
        return len(self._kept)

    def lay(self, *arrays: FloatArray) -> None:
        """Put arrays on top.

        Raises
        ------
        DataError
            The disk of temporary files is full.
        """
        size = sum(a.nbytes for a in arrays)
        if self._used + size <= self._limit:
            self._used += size
            self._kept.append(arrays)
            return
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix="estimfw_")  # noqa: SIM115 (closed by the shelf)
            place = self._file.seek(0, 2)
            for a in arrays:
                self._file.write(np.ascontiguousarray(a, dtype=np.float64).data)
        except OSError as fault:
            raise DataError(
                f"cannot keep {size / 2**20:.3g} MiB of the run in a temporary file: {fault}",
                hint="free some space, or let TMPDIR name a folder on a larger disk",
            ) from fault
        self._kept.append(_Filed(place, tuple(a.shape for a in arrays)))

    def take(self) -> Arrays:
        """What was laid down last."""
        last = self._kept.pop()
        if not isinstance(last, _Filed):
            self._used -= sum(a.nbytes for a in last)
            return last
        assert self._file is not None
        self._file.seek(last.place)
        counts = [int(np.prod(shape, dtype=int)) for shape in last.shapes]
        read = [np.frombuffer(self._file.read(8 * count)).copy() for count in counts]
        self._file.truncate(last.place)
        return tuple(values.reshape(shape) for values, shape in zip(read, last.shapes, strict=True))
