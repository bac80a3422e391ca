"""What a source hands over: streams of time-stamped rows, and the truth where it is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "SAME",
    "STATE",
    "WRITTEN_STATE",
    "Event",
    "Findings",
    "FloatArray",
    "Record",
    "Stream",
    "Truth",
    "truth_name",
]

FloatArray = NDArray[np.float64]

#: Instants closer than this (s) are one: a clock rounds.
SAME = 1e-9


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth a line in the result: a gap, a gated measurement, a moving vehicle.

    ``time`` is in s (NaN: not tied to an instant), ``source`` the stream, sensor or component, ``kind`` a
    short word that is counted (``gap``, ``duplicate``, ``stuck``, ``motion`` ...), ``text`` the reason.
    """

    time: float
    source: str
    kind: str
    text: str
    count: int = 1


@dataclass(frozen=True, slots=True)
class Findings:
    """What a monitor found in a record: events, where the run must stop (s), and where the filter starts anew (s)."""

    events: tuple[Event, ...]
    stop: float | None = None
    restarts: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Stream:
    """Rows of one sensor.

    Attributes
    ----------
    name : str
        Such as ``imu``.
    time : (N,) array, s
        Time stamp of each row: the *end* of its sampling interval.
    values : (N, k) array, SI units
        NaN marks a missing component.
    columns : tuple of k str
        For an IMU ``dtheta_x, dtheta_y, dtheta_z, dvel_x, dvel_y, dvel_z``.
    kind : 'increment', 'mean' or 'sample'
        Whether a row is an integral over its interval, a mean over it, or a value at its time.
    period : float or None, s
        Nominal sampling interval; None where rows come when they come.
    arrival : (N,) array or None, s
        When each row arrived, on the clock of the record; None: as soon as it was made.
    """

    name: str
    time: FloatArray
    values: FloatArray
    columns: tuple[str, ...]
    kind: Literal["increment", "mean", "sample"] = "sample"
    period: float | None = None
    arrival: FloatArray | None = None

    def __len__(self) -> int:
        return int(self.time.shape[0])


@dataclass(frozen=True, slots=True)
class Truth:
    """What really was, where a source knows it.

    ``values[name]`` has a leading time axis, or none where the quantity is constant. Names and frames
    are those of the nominal variables and of the blocks: ``C_bn`` (..., 3, 3), ``velocity_n`` (..., 3) m/s,
    ``accel_bias_b`` (..., 3) m/s^2, ``gyro_bias_b`` (..., 3) rad/s. ``state:LABEL`` is the true value of a state.

    ``between`` says what holds between the instants: the ``next`` one's value, as of a simulation that knows every step, or what
    is ``linear`` between both, of ``wraps`` the shorter way round a turn; then nothing is known before and after them.
    """

    time: FloatArray
    values: Mapping[str, FloatArray]
    between: Literal["next", "linear"] = "next"
    wraps: frozenset[str] = frozenset()


#: How the truth of a state is called, and how that is written in an archive, where a colon has no place.
STATE, WRITTEN_STATE = "state:", "state_"


def truth_name(written: str) -> str:
    """The name of a truth, of its name in an archive."""
    return STATE + written.removeprefix(WRITTEN_STATE) if written.startswith(WRITTEN_STATE) else written


@dataclass(frozen=True, slots=True)
class Record:
    """Streams by name, the truth if known, what was found on reading, and where it came from.

    ``initial`` carries what the source itself says about the start, such as a simulated misaligned attitude
    (``C_bn``) or the start attitude in a log's header. ``attributes`` are JSON values for the provenance.
    """

    streams: Mapping[str, Stream]
    truth: Truth | None = None
    events: tuple[Event, ...] = ()
    initial: Mapping[str, FloatArray] = field(default_factory=dict)
    attributes: Mapping[str, object] = field(default_factory=dict)
