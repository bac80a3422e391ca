"""Readers of IMU logs: a file in, an ``ImuLog`` out, in the conventions of this package.

* Time stamps in s, at the *end* of each sampling interval.
* Increments over the interval: ``dtheta_x, dtheta_y, dtheta_z`` in rad, ``dvel_x, dvel_y, dvel_z`` in m/s.
* The axes are the file's own (x, y, z); what they are to the vehicle says ``mounting`` of the source.
* A missing number stays NaN; what is to become of it is the source's business.

Each reader is a function ``read(path, layout) -> ImuLog`` and raises ``DataError`` with the file, and the line where
there are lines, for everything that it cannot read with certainty.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from estimfw.data.readers.file_there import refuse_missing_file
from estimfw.errors import DataError, Location
from estimfw_inertial.readers import csv, npz, psins_imu
from estimfw_inertial.readers.imu_log import ImuLog
from estimfw_inertial.readers.layout import CsvLayout

__all__ = ["CONTENTS", "FORMATS", "CsvLayout", "ImuLog", "format_of", "read_log"]

Reader = Callable[[Path, CsvLayout], ImuLog]

#: By the name that a config gives the format.
FORMATS: dict[str, Reader] = {"csv": csv.read, "npz": npz.read, "psins": psins_imu.read}
#: What a log holds of which the config can say nothing.
CONTENTS = {
    "npz": "an NPZ log holds increments, `dtheta` in rad and `dvel` in m/s over each interval",
    "psins": "a PSINS log holds increments, with scale factors in arcsec and ug s in its header",
}
_SUFFIXES = {".csv": "csv", ".tsv": "csv", ".txt": "csv", ".npz": "npz", ".imu": "psins"}


def read_log(path: Path, layout: CsvLayout | None = None, format: str = "auto") -> ImuLog:
    """Read a log.

    Parameters
    ----------
    path : Path
    layout : CsvLayout, optional
        What the columns of a CSV file mean; the other formats say it themselves.
    format : str
        A key of ``FORMATS``, or ``auto``: by the suffix of the file.

    Raises
    ------
    DataError
        No such file, not a file, not permitted, an unknown suffix, or contents that are not what they should be.
    """
    refuse_missing_file(path, "the IMU log")
    format = format_of(path, format)
    if format not in FORMATS:
        raise DataError(
            f"the suffix {path.suffix!r} does not tell the format",
            location=Location(str(path)),
            hint=f"say `format`: one of {', '.join(FORMATS)}",
        )
    try:
        return FORMATS[format](path, layout or CsvLayout())
    except OSError as cause:
        raise DataError(f"cannot read the IMU log: {cause.strerror or cause}", location=Location(str(path))) from cause


def format_of(path: Path, format: str = "auto") -> str:
    """A key of ``FORMATS``, by the suffix of the file where the format is ``auto``; empty if that is unknown."""
    return _SUFFIXES.get(path.suffix.lower(), "") if format == "auto" else format
