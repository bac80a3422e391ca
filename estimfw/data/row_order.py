"""Rows in the order of time: what to do with a time stamp that goes backwards, or comes twice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME, Event
from estimfw.errors import DataError, Location

__all__ = ["Rows", "TimeErrors", "in_order", "jump_near", "known_jump"]

FloatArray = NDArray[np.float64]
TimeErrors = Literal["error", "sort", "drop"]

#: Jumps that clocks make, in s.
_KNOWN_JUMPS = ((604800.0, "a GPS week"), (86400.0, "a day"), (43200.0, "half a day"), (3600.0, "an hour"))


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows of a log on their way into a record.

    Attributes
    ----------
    file : str
    time : (N,) array, s
    values : (N, k) array
    lines : (N,) int array or None
        Line of each row in the file, where it has lines.
    stream : str
        Named in events.
    arrival : (N,) array or None, s
        When each row arrived, where the log says it.
    """

    file: str
    time: FloatArray
    values: FloatArray
    lines: NDArray[np.int64] | None = None
    stream: str = "imu"
    arrival: FloatArray | None = None

    def take(self, which: NDArray[np.bool_] | NDArray[np.int64] | slice) -> Rows:
        lines = self.lines[which] if self.lines is not None else None
        arrival = self.arrival[which] if self.arrival is not None else None
        return Rows(self.file, self.time[which], self.values[which], lines, self.stream, arrival)

    def between(self, start: float | None, stop: float | None) -> Rows:
        """Rows with ``start < time <= stop`` (s; None: no limit)."""
        later = self.time > (-np.inf if start is None else start + SAME)
        return self.take(later & (self.time <= (np.inf if stop is None else stop + SAME)))

    def at(self, row: int) -> Location:
        """The file, and the line of a row."""
        return Location(self.file, int(self.lines[row]) if self.lines is not None else None)


def in_order(rows: Rows, time_errors: TimeErrors) -> tuple[Rows, tuple[Event, ...]]:
    """Rows whose time grows strictly.

    Parameters
    ----------
    rows : Rows
    time_errors : 'error', 'sort' or 'drop'
        What becomes of rows that are earlier than one before them.

    Raises
    ------
    DataError
        A time stamp that is not a number; one that goes backwards (``error``); two different rows with one time stamp.
    """
    holes = np.flatnonzero(~np.isfinite(rows.time))
    if holes.size:
        raise DataError(f"row {holes[0] + 1} has no time stamp", location=rows.at(int(holes[0])))
    back = rows.time < np.maximum.accumulate(rows.time) - SAME
    events: tuple[Event, ...] = ()
    if back.any():
        rows, events = _straightened(rows, back, time_errors)
    rows, repeated = _without_repeats(rows)
    return rows, (*events, *repeated)


def _straightened(rows: Rows, back: NDArray[np.bool_], how: TimeErrors) -> tuple[Rows, tuple[Event, ...]]:
    first, count = int(np.argmax(back)), int(np.count_nonzero(back))
    seen = f"time goes backwards, from {rows.time[first - 1]:.10g} s to {rows.time[first]:.10g} s"
    if how == "error":
        raise DataError(
            f"{seen}{known_jump(rows.time[first] - rows.time[first - 1])}",
            location=rows.at(first),
            hint="`time_errors: sort` puts the rows in order, `time_errors: drop` leaves the late ones out",
        )
    done = "sorted" if how == "sort" else "dropped"
    event = Event(
        float(rows.time[first]),
        rows.stream,
        "time order",
        f"{seen}; {count} late row{'s' if count > 1 else ''} {done}",
        count,
    )
    kept = np.argsort(rows.time, kind="stable") if how == "sort" else ~back
    return rows.take(kept), (event,)


def _without_repeats(rows: Rows) -> tuple[Rows, tuple[Event, ...]]:
    same = np.concatenate([[False], np.diff(rows.time) <= SAME])
    if not same.any():
        return rows, ()
    later = np.flatnonzero(same)
    equal = np.array([np.array_equal(rows.values[k], rows.values[k - 1], equal_nan=True) for k in later])
    if not equal.all():
        row = int(later[np.argmin(equal)])
        raise DataError(
            f"two different rows have the time stamp {rows.time[row]:.10g} s",
            location=rows.at(row),
            hint="time stamps with too few digits, or two logs in one file?",
        )
    what = "a row repeats the one before it and is" if later.size == 1 else f"{later.size} rows repeat others and are"
    text = f"{what} dropped, first at {rows.time[later[0]]:.10g} s"
    return rows.take(~same), (Event(float(rows.time[later[0]]), rows.stream, "duplicate", text, int(later.size)),)


def known_jump(step: float) -> str:
    """What a clock that jumped by so many s may have done, as the end of a sentence; empty if nothing is known."""
    jump = jump_near(step)
    return f": {dict(_KNOWN_JUMPS)[jump]} ({jump:.0f} s)?" if jump else ""


def jump_near(step: float) -> float:
    """The known jump of clocks (s, without sign) that a step of so many s may be; 0 if there is none."""
    return next((jump for jump, _ in _KNOWN_JUMPS if abs(abs(step) - jump) < 0.01 * jump), 0.0)
