"""The unit of the time axes: seconds, or hours where there are many."""

from __future__ import annotations

from dataclasses import dataclass

from estimfw.data.record import FloatArray

__all__ = ["TimeScale"]

LONG = 7200.0


@dataclass(frozen=True, slots=True)
class TimeScale:
    """``seconds`` in one ``unit`` of the axis."""

    unit: str
    seconds: float

    @classmethod
    def of(cls, time: FloatArray) -> TimeScale:
        """Hours for a record of more than two of them, else seconds. ``time`` is (N,), s."""
        span = float(time[-1] - time[0]) if time.size else 0.0
        return cls("h", 3600.0) if span > LONG else cls("s", 1.0)

    def of_seconds(self, time: FloatArray) -> FloatArray:
        """Times (N,) in the axis' unit."""
        return time / self.seconds
