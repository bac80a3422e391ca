"""Text logs of the PSINS toolbox (``.imu``): integer counts under a header with their scale factors.

After comments (``%``) come three lines of six numbers::

    pitch roll yaw [deg]            velocity east north up [m/s]
    latitude longitude [deg]        height [m], time of the start [s], sampling interval [ms], g [m/s^2]
    gyro counts x y z [arcsec]      accelerometer counts x y z [ug s], in units of the g above

and then a row of six counts a sample. Yaw is counter-clockwise from north. The toolbox calls the start attitude
"maybe inaccurate".
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimfw.data.readers.number_table import NumberTable, decoded
from estimfw.errors import DataError, Location
from estimfw_inertial.readers.imu_log import ImuLog, imu_stream
from estimfw_inertial.readers.layout import CsvLayout
from estimfw_inertial.rotation import attitude_matrix

__all__ = ["read"]

FloatArray = NDArray[np.float64]

_WIDTH = 6
_HEADER = (
    "pitch roll yaw (deg) and velocity (m/s)",
    "latitude longitude (deg) height (m) start (s) interval (ms) g (m/s^2)",
    "scale factors of gyros (arcsec) and accelerometers (ug s)",
)


def read(path: Path, layout: CsvLayout) -> ImuLog:
    """Read a log; ``layout`` is not used.

    Raises
    ------
    DataError
        With the line: a header or a row that is not as above, no rows.
    """
    del layout
    header, text, first_line = _split_header(path, decoded(path))
    start, place, scale = header
    latitude, longitude, height, begin, interval, gravity = place
    if not (interval > 0.0 and gravity > 0.0 and np.all(scale != 0.0)):
        raise DataError(
            f"sampling interval {interval:g} ms, g {gravity:g} m/s^2, scale factors {scale.tolist()}",
            location=Location(str(path), first_line - 1),
            hint="expected positive numbers",
        )
    table = NumberTable(path, text, first_line, _WIDTH)
    counts = table.values(tuple(range(_WIDTH)))
    period = interval / 1000.0
    time = begin + period * np.arange(1, len(counts) + 1)
    dtheta = counts[:, :3] * np.radians(scale[:3] / 3600.0)
    dvel = counts[:, 3:] * (scale[3:] * 1e-6 * gravity)
    return ImuLog(
        imu_stream(time, dtheta, dvel, period),
        initial={"C_bn": _attitude(start), "velocity_n": start[3:].copy()},
        header={
            "latitude": float(np.radians(latitude)),
            "longitude": float(np.radians(longitude)),
            "height": float(height),
        },
        lines=table.lines(len(counts)),
    )


def _attitude(start: FloatArray) -> FloatArray:
    pitch, roll, yaw = np.radians(start[:3])
    return attitude_matrix(yaw, pitch, roll)


def _split_header(path: Path, text: str) -> tuple[list[FloatArray], str, int]:
    """The three header lines, the text after them, and the line at which it begins."""
    header: list[FloatArray] = []
    rest, number = text, 0
    while rest and len(header) < len(_HEADER):
        line, _, rest = rest.partition("\n")
        number += 1
        if line.strip() and not line.lstrip().startswith("%"):
            header.append(_header_row(path, line, number, _HEADER[len(header)]))
    if len(header) < len(_HEADER):
        raise DataError(
            f"the file ends inside its header, before the line with {_HEADER[len(header)]}",
            location=Location(str(path), number or None),
        )
    return header, rest, number + 1


def _header_row(path: Path, line: str, number: int, meaning: str) -> FloatArray:
    try:
        row = np.array([float(cell) for cell in line.split()])
    except ValueError:
        row = np.array([])
    if row.size != _WIDTH or not np.all(np.isfinite(row)):
        raise DataError(
            f"{line.strip()[:60]!r} is no header line of a PSINS log",
            location=Location(str(path), number),
            hint=f"expected six numbers: {meaning}",
        )
    return row
