"""Sensors that stopped: a channel that shows the same number for far longer than its resolution explains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event, Stream

__all__ = ["stuck_events"]

FloatArray = NDArray[np.float64]

#: A channel is not called stuck before it has shown the same number this long, in s and in samples.
_SHORTEST = 5.0
_FEWEST = 100
_NAMES = ("gyro x", "gyro y", "gyro z", "accelerometer x", "accelerometer y", "accelerometer z")


def stuck_events(stream: Stream) -> tuple[Event, ...]:
    """An event for each channel of the stream ``imu`` that stands still, at the begin of its longest standstill.

    Notes
    -----
    A channel of coarse resolution repeats itself: runs of mean length m in N samples have a longest of about m ln(N/m).
    Longer than five times that, m taken without the longest run, is no chance.
    """
    period = stream.period if stream.period is not None else float(np.median(np.diff(stream.time)))
    least = max(_FEWEST, round(_SHORTEST / period))
    return tuple(
        Event(
            float(stream.time[start]),
            "imu",
            "stuck",
            f"{_NAMES[channel]} shows {stream.values[start, channel] / period:.6g} without change for {length * period:.4g} s",
            length,
        )
        for channel in range(stream.values.shape[1])
        for start, length in _standstill(stream.values[:, channel], least)
    )


def _standstill(values: FloatArray, least: int) -> list[tuple[int, int]]:
    """Begin and length of the longest run of equal values, if it is too long."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(values) != 0.0) + 1])
    lengths = np.diff(np.concatenate([starts, [values.size]]))
    k = int(np.argmax(lengths))
    longest = int(lengths[k])
    others = (values.size - longest) / max(1, lengths.size - 1)
    if longest < least or longest < 5.0 * others * np.log(values.size):
        return []
    return [(int(starts[k]), longest)]
