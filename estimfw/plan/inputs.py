"""Known inputs over time: what schedules say, and readings of a stream held until the next one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME, Stream
from estimfw.errors import DataError
from estimfw.model.parts import KnownInput

__all__ = ["InputValues", "input_values", "inputs_at"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class InputValues:
    """Instants (N,) s from which the values (N, axes) of one input hold; NaN where a reading is missing.

    A missing component keeps the reading before; before the first one it is zero.
    """

    time: FloatArray
    values: FloatArray

    def at(self, time: FloatArray) -> FloatArray:
        """Values (K, axes) that hold from these instants (K,) on."""
        if not self.time.size:
            return np.zeros((time.size, self.values.shape[1]))
        row = np.searchsorted(self.time, time + SAME, side="right") - 1
        there = np.where(np.isfinite(self.values), np.arange(self.time.size)[:, None], -1)
        last = np.maximum.accumulate(there, axis=0)[np.maximum(row, 0)]
        held = np.take_along_axis(self.values, np.maximum(last, 0), axis=0)
        return np.where((row[:, None] >= 0) & (last >= 0), held, 0.0)


def input_values(known: KnownInput, streams: Mapping[str, Stream]) -> InputValues:
    """The values of one input, from its schedule or from the stream that it reads.

    Raises
    ------
    DataError
        The stream or a column is not there, or its time goes backwards.
    """
    if known.stream is None:
        return InputValues(np.array(known.times), np.array(known.values).reshape(-1, len(known.axes)))
    if known.stream not in streams:
        others = (
            f"it has: {', '.join(sorted(streams)) or 'none'}; if the readings are there, give the input its `stream:`"
        )
        raise DataError(
            f"input {known.name!r} needs the stream {known.stream!r}, which the source does not have", hint=others
        )
    stream = streams[known.stream]
    missing = [c for c in known.columns if c not in stream.columns]
    if missing:
        raise DataError(
            f"input {known.name!r} needs the column {missing[0]!r}", hint=f"the stream has: {', '.join(stream.columns)}"
        )
    if not np.all(np.diff(stream.time) >= 0.0):
        raise DataError(
            f"stream {stream.name!r}: its time goes backwards", hint="sort the rows, or drop those that are late"
        )
    return InputValues(stream.time, stream.values[:, [stream.columns.index(c) for c in known.columns]])


def inputs_at(inputs: Sequence[InputValues], time: FloatArray) -> FloatArray:
    """All known inputs (K, inputs) that hold from these instants (K,) on."""
    return np.concatenate([np.zeros((time.size, 0)), *(values.at(time) for values in inputs)], axis=1)
