"""Does the vehicle stand? Windows of the record in which it turns or accelerates are flagged.

A base that sways by tenths of a degree, or shakes, stands; one that drives off or is turned does not. Means over a window
suppress vibration and quantisation: the mean rate against the limit, and the mean specific force against that of the vehicle
at rest. It is at rest in the first stretch of ten windows that agree; in a record without one, where the most windows agree.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.ndimage import label as runs_of
from scipy.spatial import cKDTree

from estimfw.config.types import Settings, Site, positive_quantity
from estimfw.data.record import Event, Findings, Record, Stream
from estimfw.errors import DataError

__all__ = ["MotionConfig", "MotionMonitor", "force_at_rest", "motion"]

FloatArray = NDArray[np.float64]
DEGREE = np.pi / 180.0
#: Windows in a row that agree: the vehicle is at rest.
REST = 10


class MotionConfig(Settings):
    """What counts as motion, and what to do: ``flag`` it, ``stop`` the run before it, or ``restart`` after it."""

    kind: Literal["sins_static.motion"]
    action: Annotated[
        Literal["flag", "stop", "restart"],
        Field(description="flag it in the result, end the run before it, or begin anew after it"),
    ] = "flag"
    window: Annotated[float, positive_quantity("s"), Field(description="time over which rows are averaged")] = 1.0
    rate: Annotated[
        float, positive_quantity("rad/s", examples=("0.5 deg/s",)), Field(description="a faster mean rate is motion")
    ] = 0.5 * DEGREE
    acceleration: Annotated[
        float,
        positive_quantity("m/s^2", examples=("0.2 m/s^2", "20 mg")),
        Field(description="a mean specific force that differs by more from that of the vehicle at rest is motion"),
    ] = 0.2


@dataclass(frozen=True, slots=True)
class MotionMonitor:
    """Looks at the stream ``imu``."""

    name: str
    cfg: MotionConfig

    def inspect(self, record: Record) -> Findings:
        """One event for each stretch of motion (``time`` is its start, ``count`` its windows), and what follows from it.

        Raises
        ------
        DataError
            The record has no stream ``imu``.
        """
        if "imu" not in record.streams:
            raise DataError(
                f"monitor {self.name!r} needs the stream 'imu'", hint=f"there are: {', '.join(record.streams)}"
            )
        ends, rate, force = window_means(record.streams["imu"], self.cfg.window)
        if not len(rate):
            return Findings(())
        turning = np.linalg.norm(rate, axis=1) > self.cfg.rate
        rest = force_at_rest(force, turning, self.cfg.acceleration)
        pushed = np.linalg.norm(force - rest, axis=1) > self.cfg.acceleration
        stretches, count = runs_of(turning | pushed)
        windows = [np.flatnonzero(np.asarray(stretches) == k) for k in range(1, count + 1)]
        events = tuple(self._event(w, ends, turning, pushed) for w in windows)
        if not events or self.cfg.action == "flag":
            return Findings(events)
        if self.cfg.action == "stop":
            return Findings(events, stop=events[0].time)
        return Findings(events, restarts=tuple(float(ends[w[-1], 1]) for w in windows))

    def _event(
        self, windows: NDArray[np.int64], ends: FloatArray, turning: NDArray[np.bool_], pushed: NDArray[np.bool_]
    ) -> Event:
        start, stop = ends[windows[0], 0], ends[windows[-1], 1]
        what = " and ".join(
            w for w, seen in (("turns", turning[windows].any()), ("accelerates", pushed[windows].any())) if seen
        )
        text = f"the vehicle {what} from {start:.1f} to {stop:.1f} s: not a static base"
        return Event(float(start), self.name, "motion", text, int(windows.size))


def force_at_rest(force: FloatArray, turning: NDArray[np.bool_], limit: float) -> FloatArray:
    """Mean specific force (3,) m/s^2 of the vehicle at rest.

    Parameters
    ----------
    force : (W, 3) array, m/s^2
        Means of windows; NaN where a window has no rows.
    turning : (W,) array of bool
        Windows that cannot be rest.
    limit : float, m/s^2
        Windows that differ by less agree.
    """
    still = force[~turning & np.isfinite(force).all(axis=1)]
    if not len(still):
        return np.asarray(force[0])
    begin = 0
    for k in range(len(still)):
        if np.linalg.norm(still[k] - still[begin]) > limit:
            begin = k
        elif k - begin + 1 == REST:
            return np.asarray(np.median(still[begin : k + 1], axis=0))
    tree = cKDTree(still)
    most = int(np.argmax(tree.query_ball_point(still, limit, return_length=True)))
    return np.asarray(np.median(still[tree.query_ball_point(still[most], limit)], axis=0))


def window_means(imu: Stream, window: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Start and end (W, 2) s, mean rate (W, 3) rad/s and mean specific force (W, 3) m/s^2 of whole windows.

    Rows that are not finite do not count; a window of nothing else has NaN means.
    """
    period = imu.period or float(np.median(np.diff(imu.time)))
    per = max(1, round(window / period))
    count = len(imu) // per
    time = imu.time[: count * per].reshape(count, per)
    values = imu.values[: count * per, :6].reshape(count, per, 6)
    good = np.isfinite(values).all(axis=2, keepdims=True)
    rows = good.sum(axis=1)
    means = np.where(good, values, 0.0).sum(axis=1) / np.where(rows, rows, np.nan) / period
    return np.stack([time[:, 0] - period, time[:, -1]], axis=1), means[:, :3], means[:, 3:]


def motion(name: str, cfg: MotionConfig, site: Site | None) -> MotionMonitor:
    return MotionMonitor(name, cfg)
