"""Samples of a mechanization out of an IMU stream."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Stream
from estimfw.errors import DataError

__all__ = ["IMU_COLUMNS", "imu_samples"]

FloatArray = NDArray[np.float64]

IMU_COLUMNS = ("dtheta_x", "dtheta_y", "dtheta_z", "dvel_x", "dvel_y", "dvel_z")


def imu_samples(stream: Stream, rows: NDArray[np.int64], per_step: int) -> FloatArray:
    """Samples (..., K, 1 + 6 per_step): dt in s, then dtheta in rad and dvel in m/s of each stream row of the step.

    Parameters
    ----------
    stream : Stream
        Of increments, with the columns `IMU_COLUMNS` among its own; its values may have leading axes (runs).
    rows : (K + 1,) array
        Step k is made of the stream rows ``rows[k]:rows[k + 1]``, ``per_step`` of them.

    Notes
    -----
    dt is the time that the increments cover. Over a gap that is less than the stamps say: nothing is known of the rest of it,
    so velocity and attitude are as they were before it.

    Raises
    ------
    DataError
        Other columns, no increments, time that stands still, or a number that is none.
    """
    used = slice(int(rows[0]), int(rows[-1]))
    values = stream.values[..., used, :][..., _columns(stream)]
    _check_finite(values, stream.time[used], stream.name)
    steps, lead = len(rows) - 1, values.shape[:-2]
    covered = _covered(stream)[used].reshape(steps, per_step).sum(axis=1)[:, None]
    flat = values.reshape(*lead, steps, 6 * per_step)
    return np.concatenate([np.broadcast_to(covered, (*lead, steps, 1)), flat], axis=-1)


def _columns(stream: Stream) -> list[int]:
    missing = [c for c in IMU_COLUMNS if c not in stream.columns]
    if missing:
        raise DataError(
            f"stream {stream.name!r} has no column {', '.join(missing)}; it has {', '.join(stream.columns)}",
            hint=f"a mechanization needs {', '.join(IMU_COLUMNS)}",
        )
    if stream.kind != "increment":
        raise DataError(
            f"stream {stream.name!r} holds values at instants, a mechanization needs increments over intervals",
            hint="multiply rates and specific forces by the sampling interval",
        )
    return [stream.columns.index(c) for c in IMU_COLUMNS]


def _check_finite(values: FloatArray, time: FloatArray, name: str) -> None:
    bad = ~np.isfinite(values).all(axis=-1).reshape(-1, time.size).all(axis=0)
    if np.any(bad):
        raise DataError(
            f"stream {name!r}: the sample at {time[int(np.argmax(bad))]:g} s is not a number ({int(bad.sum())} such samples)",
            hint="let the source bridge short losses, or begin after them",
        )


def _covered(stream: Stream) -> FloatArray:
    """The time (s) that each row's increments cover: the nominal period where the stamps agree with it, or over a gap."""
    interval = np.diff(stream.time)
    if np.any(interval <= 0.0):
        at = int(np.argmax(interval <= 0.0)) + 1
        raise DataError(
            f"stream {stream.name!r}: the time of row {at + 1}, {stream.time[at]:.9g} s, is not after that of the row before",
            hint="drop duplicate rows and sort the others",
        )
    period = stream.period or (float(np.median(interval)) if interval.size else None)
    if period is None:
        raise DataError(f"stream {stream.name!r} has one row and no period", hint="give the period of the IMU")
    interval = np.concatenate([[period], interval])
    nominal = (np.abs(interval - period) <= 1e-6 * period) | (interval > 1.5 * period)
    return np.where(nominal, period, interval)
