"""Measurement rows that came and are not due yet: the session's part of what the timeline decides in a batch run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.data.record import SAME
from estimfw.errors import DataError, UsageError
from estimfw.model.parts import KnownInput
from estimfw.plan.plan import MeasurementPlan

__all__ = ["DueRow", "WaitingRows"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class DueRow:
    """A row that is due, the interval (s) that it stands for, and how many earlier ones it supersedes."""

    time: float
    values: FloatArray
    interval: float
    superseded: int


class WaitingRows:
    """Rows by stream, in the order of their time.

    Parameters
    ----------
    readers : sequence of MeasurementPlan and KnownInput
        Those that read a stream say which streams there are, and with which columns.
    begin : float, s
    periods : mapping of str to float, s
        Nominal interval of the streams where it is known; else the time since the row before.
    """

    def __init__(
        self, readers: Sequence[MeasurementPlan | KnownInput], begin: float, periods: Mapping[str, float]
    ) -> None:
        self.columns: dict[str, tuple[str, ...]] = {}
        for m in readers:
            if m.stream is not None:
                self.columns[m.stream] = tuple(dict.fromkeys((*self.columns.get(m.stream, ()), *m.columns)))
        self.periods = periods
        self._rows: dict[str, list[tuple[float, FloatArray]]] = {stream: [] for stream in self.columns}
        self._before = dict.fromkeys(self.columns, begin)

    def row(self, stream: str, values: ArrayLike | Mapping[str, float]) -> FloatArray:
        """The values in the order of the stream's columns.

        Raises
        ------
        UsageError
            Nothing reads that stream.
        DataError
            Other values than the columns.
        """
        if stream not in self.columns:
            known = ", ".join(sorted(self.columns)) or "none"
            raise UsageError(f"nothing reads the stream {stream!r}", hint=f"streams: {known}")
        columns = self.columns[stream]
        if isinstance(values, Mapping):
            if set(values) != set(columns):
                raise DataError(
                    f"stream {stream!r}: got the columns {', '.join(sorted(values)) or 'none'}",
                    hint=f"due are: {', '.join(columns)}",
                )
            values = [values[c] for c in columns]
        row = np.atleast_1d(np.asarray(values, dtype=float))
        if row.shape != (len(columns),):
            raise DataError(
                f"stream {stream!r}: {row.size} values where {len(columns)} are due",
                hint=f"in the order {', '.join(columns)}",
            )
        return row

    def add(self, stream: str, time: float, row: FloatArray) -> bool:
        """Keep a row until it is due; False if it was there already.

        Raises
        ------
        DataError
            Another row of the stream has the same time and other values.
        """
        rows = self._rows[stream]
        for known_time, known in rows:
            if abs(known_time - time) <= SAME:
                if np.array_equal(known, row, equal_nan=True):
                    return False
                raise DataError(f"stream {stream!r}: two rows have one time, {time:g} s, but differ")
        rows.append((time, row))
        rows.sort(key=lambda entry: entry[0])
        return True

    def copy(self) -> WaitingRows:
        """The same rows, waiting by themselves."""
        other = copy(self)
        other._rows = {stream: list(rows) for stream, rows in self._rows.items()}
        other._before = dict(self._before)
        return other

    def instants(self, until: float) -> list[float]:
        """Times of all rows up to an instant."""
        return [time for rows in self._rows.values() for time, _ in rows if time <= until + SAME]

    def take(self, until: float) -> dict[str, DueRow]:
        """The last row up to an instant of each stream that has one; they and those before them wait no more."""
        due = {}
        for stream, rows in self._rows.items():
            ready = [entry for entry in rows if entry[0] <= until + SAME]
            if not ready:
                continue
            time, values = ready[-1]
            before = ready[-2][0] if len(ready) > 1 else self._before[stream]
            interval = self.periods.get(stream) or max(time - before, 0.0) or 1.0
            due[stream] = DueRow(time, values, interval, len(ready) - 1)
            self._before[stream] = time
            self._rows[stream] = rows[len(ready) :]
        return due
