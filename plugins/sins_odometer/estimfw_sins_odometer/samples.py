"""Samples of the preintegration out of a stream of increments with a speed beside them."""

from __future__ import annotations

import numpy as np
from estimfw_inertial.increments import IMU_COLUMNS, imu_samples
from numpy.typing import NDArray

from estimfw.data.record import Stream
from estimfw.errors import DataError

__all__ = ["COLUMNS", "SPEED", "odometer_samples", "speeds", "velocity_at"]

FloatArray = NDArray[np.float64]

SPEED = "speed"
COLUMNS = (*IMU_COLUMNS, SPEED)


def odometer_samples(stream: Stream, rows: NDArray[np.int64], per_step: int, turn: FloatArray) -> FloatArray:
    """Samples (..., K, 1 + 7 per_step): dt in s, then dtheta (rad), dvel (m/s) and speed (m/s) of each row of the step.

    Parameters
    ----------
    stream : Stream
        Of increments, with the columns `COLUMNS` among its own; the speed is that at the time of its row.
    rows : (K + 1,) array
        Step k is made of the stream rows ``rows[k]:rows[k + 1]``, ``per_step`` of them.
    turn : (3, 3) array
        From the axes of the IMU to those of the vehicle.

    Raises
    ------
    DataError
        Columns are missing, or numbers are none.
    """
    imu = imu_samples(stream, rows, per_step)
    lead, steps = imu.shape[:-2], len(rows) - 1
    triads = imu[..., 1:].reshape(*lead, steps, per_step, 2, 3) @ turn.T
    speed = speeds(stream)[..., int(rows[0]) : int(rows[-1])].reshape(*lead, steps, per_step, 1)
    sample = np.concatenate([triads.reshape(*lead, steps, per_step, 6), speed], axis=-1)
    return np.concatenate([imu[..., :1], sample.reshape(*lead, steps, 7 * per_step)], axis=-1)


def speeds(stream: Stream) -> FloatArray:
    """The speed (..., N) m/s; missing readings lie on a straight line between their neighbours.

    Raises
    ------
    DataError
        There is no such column, or no reading in it.
    """
    if SPEED not in stream.columns:
        raise DataError(
            f"stream {stream.name!r} has no column {SPEED!r}; it has {', '.join(stream.columns)}",
            hint="join the odometer's speed to the IMU: preprocess: {speed: {kind: join, ...}}",
        )
    speed = np.asarray(stream.values[..., stream.columns.index(SPEED)], dtype=float)
    if np.all(np.isfinite(speed)):
        return speed
    flat = speed.reshape(-1, speed.shape[-1]).copy()
    for line in flat:
        good = np.isfinite(line)
        if not good.any():
            raise DataError(f"stream {stream.name!r}: the speed has no reading at all")
        line[~good] = np.interp(stream.time[~good], stream.time[good], line[good])
    return flat.reshape(speed.shape)


def velocity_at(stream: Stream, row: int, turn: FloatArray, lever_arm: FloatArray) -> FloatArray:
    """Velocity of the IMU over ground in b (..., 3) m/s at the time of a row: forward speed at the end of the lever arm."""
    period = stream.period or float(np.median(np.diff(stream.time)))
    columns = [stream.columns.index(c) for c in IMU_COLUMNS[:3]]
    rate = stream.values[..., row, :][..., columns] @ turn.T / period
    velocity = np.zeros(rate.shape)
    velocity[..., 1] = speeds(stream)[..., row]
    return np.asarray(velocity - np.cross(rate, lever_arm))
