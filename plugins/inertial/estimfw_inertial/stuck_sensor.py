"""Sensors that stopped: a channel that shows the same number for far longer than its resolution explains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event, FloatArray
from estimfw.data.row_order import Rows

__all__ = ["stuck_events"]

_NAMES = ("gyro x", "gyro y", "gyro z", "accelerometer x", "accelerometer y", "accelerometer z")
#: A channel whose runs of equal numbers are this often a single one has a resolution far below its noise. By chance it shows
#: 25 equal numbers in a row once in 10^24 samples.
_CONTINUOUS = 0.9
_FEWEST = 25
#: A coarse one is not called stuck before it has shown the same number this long, in s and in samples.
_SHORTEST_COARSE = 5.0
_FEWEST_COARSE = 100


def stuck_events(rows: Rows, period: float) -> tuple[Event, ...]:
    """An event for each channel that stands still, at the begin of its longest standstill.

    Parameters
    ----------
    rows : Rows
        Increments as they were logged, in order of time, before lost ones are bridged by repetition.
    period : float, s

    Notes
    -----
    A channel of coarse resolution repeats itself: runs of mean length m in N samples have a longest of about m ln(N/m).
    Longer than five times that, m taken without the longest run, is no chance.
    """
    return tuple(
        Event(
            float(rows.time[start]),
            "imu",
            "stuck",
            f"{_NAMES[channel]} shows {rows.values[start, channel] / period:.6g} without change for "
            f"{length * period:.4g} s{_more(others)}",
            length,
        )
        for channel in range(rows.values.shape[1])
        for start, length, others in _standstill(rows.values[:, channel], period)
    )


def _standstill(values: FloatArray, period: float) -> list[tuple[int, int, int]]:
    """Begin and length of the longest run of equal values, if it is too long, and how many others are."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(values) != 0.0) + 1])
    lengths = np.diff(np.concatenate([starts, [values.size]]))
    too_long = lengths >= _least(lengths, values.size, period)
    if not too_long.any():
        return []
    k = int(np.argmax(lengths))
    return [(int(starts[k]), int(lengths[k]), int(np.count_nonzero(too_long)) - 1)]


def _least(lengths: NDArray[np.int64], count: int, period: float) -> float:
    """The shortest run of equal values that is no chance, in samples."""
    if np.mean(lengths == 1) >= _CONTINUOUS:
        return _FEWEST
    others = (count - int(lengths.max())) / max(1, lengths.size - 1)
    return float(max(_FEWEST_COARSE, _SHORTEST_COARSE / period, 5.0 * others * np.log(count)))


def _more(others: int) -> str:
    return f", and so {others} more time{'s' * (others > 1)}" if others else ""
