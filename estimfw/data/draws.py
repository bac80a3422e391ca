"""Records of many runs that share one timeline, with a leading axis over the runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Record, Truth

__all__ = ["Draws"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Draws:
    """R runs.

    Attributes
    ----------
    record : Record
        All runs: ``values`` (R, N, k) of its streams and ``initial`` values (R, ...) have the leading axis; it has no truth.
    time : (T,) array, s
        Instants of the truth.
    truth : mapping of str to array, or None
        (R or 1, T or 1, ...): 1 where runs, or instants, share a value. None: it is not known.
    """

    record: Record
    time: FloatArray
    truth: Mapping[str, FloatArray] | None

    def __len__(self) -> int:
        return int(next(iter(self.record.streams.values())).values.shape[0])

    def run(self, index: int) -> Record:
        """The record of one run, as a source without draws would hand it over."""
        streams = {name: replace(s, values=s.values[index]) for name, s in self.record.streams.items()}
        initial = {name: value[index] for name, value in self.record.initial.items()}
        return replace(self.record, streams=streams, initial=initial, truth=self._truth(index))

    def _truth(self, index: int) -> Truth | None:
        if self.truth is None:
            return None
        own = {name: value[index if value.shape[0] > 1 else 0] for name, value in self.truth.items()}
        count = self.time.size
        return Truth(self.time, {name: value if value.shape[0] == count else value[0] for name, value in own.items()})

    @classmethod
    def of(cls, records: Sequence[Record]) -> Draws:
        """Records of one timeline, made one after the other.

        Raises
        ------
        ValueError
            They differ in streams or instants.
        """
        first = records[0]
        for other in records[1:]:
            if list(other.streams) != list(first.streams) or any(
                not np.array_equal(other.streams[n].time, s.time) for n, s in first.streams.items()
            ):
                raise ValueError("the records of the runs differ in their streams or instants")
        streams = {
            n: replace(s, values=np.stack([r.streams[n].values for r in records])) for n, s in first.streams.items()
        }
        initial = {name: np.stack([np.asarray(r.initial[name]) for r in records]) for name in first.initial}
        whole = replace(first, streams=streams, initial=initial, truth=None)
        if first.truth is None:
            return cls(whole, np.zeros(0), None)
        truths = [r.truth for r in records if r.truth is not None]
        values = {n: np.stack([_with_time(t, n) for t in truths]) for n in first.truth.values}
        return cls(whole, first.truth.time, values)


def _with_time(truth: Truth, name: str) -> FloatArray:
    value = np.asarray(truth.values[name], dtype=float)
    return value if value.shape[:1] == truth.time.shape else value[None]
