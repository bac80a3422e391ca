"""The part of a record that a coarse alignment uses, and the places where it cannot work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event, Record
from estimfw.errors import ConfigError, DataError, NumericalError
from estimfw_inertial.place import SAY_THE_SITE, Place

__all__ = ["Window", "checked_place", "pole_events", "window_at_start"]

FloatArray = NDArray[np.float64]

#: Steps that a window must have: enough to see a disturbance in it.
_FEWEST = 30
#: rad; nearer to a pole there is no heading at all, or a poor one.
_NO_GYROCOMPASS = np.radians(0.01)
_POOR_GYROCOMPASS = np.radians(1.0)


@dataclass(frozen=True, slots=True)
class Window:
    """Equal steps without holes.

    Attributes
    ----------
    time : (N,) array, s
        Ends of the steps.
    dtheta : (N, 3) array, rad
    dvel : (N, 3) array, m/s
    """

    time: FloatArray
    dtheta: FloatArray
    dvel: FloatArray

    @property
    def period(self) -> float:
        """Length of a step in s."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    @property
    def duration(self) -> float:
        return self.period * self.time.size


def window_at_start(record: Record, duration: float) -> Window:
    """The first ``duration`` seconds of the stream ``imu``.

    Raises
    ------
    DataError
        No such stream, too short a record or window, or a gap or NaN inside the window.
    """
    if "imu" not in record.streams:
        known = ", ".join(sorted(record.streams)) or "none"
        raise DataError(
            "a coarse alignment needs the stream 'imu', which the source does not have", hint=f"it has: {known}"
        )
    stream = record.streams["imu"]
    if len(stream) < 2:
        raise DataError(f"stream 'imu' has {len(stream)} rows, a coarse alignment needs {_FEWEST}")
    period = stream.period if stream.period is not None else float(np.median(np.diff(stream.time)))
    count = round(duration / period)
    if count > len(stream):
        raise DataError(
            f"the coarse alignment is to last {duration:g} s, the record has only {len(stream) * period:g} s",
            hint="shorten `duration`, or give the source more of the record",
        )
    window = Window(stream.time[:count], stream.values[:count, :3], stream.values[:count, 3:6])
    _check(window, period)
    return window


def _check(window: Window, period: float) -> None:
    if window.time.size < _FEWEST:
        raise DataError(
            f"the coarse alignment would use {window.time.size} samples of {period:g} s, it needs {_FEWEST}",
            hint="lengthen `duration`",
        )
    gaps = np.flatnonzero(np.diff(window.time) > 1.5 * period)
    if gaps.size:
        k = int(gaps[0])
        raise DataError(
            f"a gap of {window.time[k + 1] - window.time[k]:g} s after {window.time[k]:g} s, inside the coarse alignment",
            hint="begin after it (`start` of the source)",
        )
    holes = np.flatnonzero(~np.isfinite(np.hstack([window.dtheta, window.dvel])).all(axis=1))
    if holes.size:
        raise DataError(
            f"the sample at {window.time[holes[0]]:g} s, inside the coarse alignment, is not a number",
            hint="begin after it (`start` of the source), or let the source bridge it (`missing: repeat`)",
        )


def checked_place(place: Place | None) -> Place:
    """The place, if one can find north there.

    Raises
    ------
    ConfigError
        No place.
    NumericalError
        At a pole.
    """
    if place is None:
        raise ConfigError("a coarse alignment needs the place", hint=SAY_THE_SITE)
    if np.pi / 2 - abs(place.latitude) < _NO_GYROCOMPASS:
        raise NumericalError(
            f"latitude {np.degrees(place.latitude):.6g} deg: at a pole the Earth's rate shows no north",
            hint="give the heading instead (`initial_attitude: {yaw: ...}`)",
        )
    return place


def pole_events(place: Place) -> tuple[Event, ...]:
    """A warning within a degree of a pole."""
    if np.pi / 2 - abs(place.latitude) > _POOR_GYROCOMPASS:
        return ()
    text = f"latitude {np.degrees(place.latitude):.4g} deg: so near a pole the Earth's rate hardly shows north"
    return (Event(float("nan"), "coarse alignment", "near pole", text),)
