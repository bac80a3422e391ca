"""Known inputs that are readings: from a record in a batch run, row by row in a session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME, Event, Record
from estimfw.errors import DataError
from estimfw.model.parts import KnownInput
from estimfw.plan.inputs import InputValues, input_values, inputs_at

__all__ = ["HeldInputs", "missing_readings", "recorded_inputs"]

FloatArray = NDArray[np.float64]


def recorded_inputs(inputs: Sequence[KnownInput], record: Record) -> tuple[InputValues, ...]:
    """The values of all inputs over a record; DataError where it lacks a stream or a column, or rows say when they arrived."""
    for known in inputs:
        stream = record.streams.get(known.stream) if known.stream is not None else None
        if stream is not None and stream.arrival is not None:
            raise DataError(
                f"the input {known.name!r} reads the stream {known.stream!r}, whose rows say when they arrived: a run "
                "does not know what a live filter would have held until then",
                hint="leave `arrival` out of that log, and all its rows count as in time",
            )
    return tuple(input_values(known, record.streams) for known in inputs)


def missing_readings(inputs: Sequence[KnownInput], values: Sequence[InputValues], start: float) -> list[Event]:
    """What was put for readings that are not there: the one before, or zero."""
    events = []
    for known, held in zip(inputs, values, strict=True):
        if known.stream is None:
            continue
        bad = ~np.isfinite(held.values).all(axis=1)
        if bad.any():
            text = f"readings of the input {known.name} are missing: those before are held"
            events.append(Event(float(held.time[np.argmax(bad)]), known.stream, "missing", text, int(bad.sum())))
        first = held.time[~bad][0] if np.any(~bad) else np.inf
        if first > start + SAME:
            text = f"no reading of the input {known.name} before {first:g} s: zero is taken"
            events.append(Event(start, known.stream, "missing", text))
    return events


class HeldInputs:
    """The inputs of a session: rows of the streams that they read, as they come.

    Parameters
    ----------
    inputs : sequence of KnownInput
    columns : mapping of stream to columns
        In which order the rows of a stream come.
    """

    def __init__(self, inputs: Sequence[KnownInput], columns: Mapping[str, Sequence[str]]) -> None:
        self._known, self._columns = tuple(inputs), columns
        self._values = [
            input_values(k, {}) if k.stream is None else InputValues(np.zeros(0), np.zeros((0, len(k.axes))))
            for k in inputs
        ]

    def copy(self) -> HeldInputs:
        """The same values, held by themselves."""
        other = copy(self)
        other._values = list(self._values)
        return other

    @property
    def instants(self) -> list[float]:
        """At which an input changes, as far as is known."""
        return [float(t) for values in self._values for t in values.time]

    def add(self, stream: str, time: float, row: FloatArray) -> None:
        """A row of a stream, in the order of its columns."""
        for i, known in enumerate(self._known):
            if known.stream != stream:
                continue
            own = row[[list(self._columns[stream]).index(c) for c in known.columns]]
            held = self._values[i]
            at = int(np.searchsorted(held.time, time, side="right"))
            self._values[i] = InputValues(np.insert(held.time, at, time), np.insert(held.values, at, own, axis=0))

    def take(self, time: float) -> FloatArray:
        """All inputs (1, inputs) that hold from this instant on; readings before it are forgotten."""
        now = np.array([time])
        for i, (known, held) in enumerate(zip(self._known, self._values, strict=True)):
            past = held.time <= time + SAME
            if known.stream is not None and past.any():
                later = InputValues(np.append(now, held.time[~past]), np.vstack([held.at(now), held.values[~past]]))
                self._values[i] = later
        return inputs_at(self._values, now)
