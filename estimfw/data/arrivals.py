"""Rows that arrive later than the instant that they are for: would a filter that runs along have gone past them?

At any moment such a filter has done the steps up to the newest row of its clock: of the driving stream, or, without one, of any
stream. A row is late if its step is done when it arrives; rows that arrive at one moment are handed over together. If the filter
need not go back by more than ``replay`` s, it is as if the row had been in time. The whole record is known here, so nobody has to
go back in fact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME, Event, FloatArray, Stream

__all__ = ["Arrivals", "arrivals_of"]

Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Arrivals:
    """What the filter has done when.

    Attributes
    ----------
    arrival : (N,) array, s
        Of the rows of its clock, in order.
    newest : (N,) array, s
        The largest time stamp up to each.
    ends : (K,) array, s
        Of the steps.
    replay : float, s
        By how much it can go back.
    """

    arrival: FloatArray
    newest: FloatArray
    ends: FloatArray
    replay: float

    def judged(
        self, stream: Stream, rows: NDArray[np.int64], step: NDArray[np.int64]
    ) -> tuple[Bools, Bools, FloatArray]:
        """Which of the rows (M,) of a stream come after their steps, which of them too late, and after how many s.

        ``step`` (M,) are the steps at whose ends they fall due.
        """
        assert stream.arrival is not None
        time, arrived = stream.time[rows], stream.arrival[rows]
        count = np.searchsorted(self.arrival, arrived - SAME)
        newest = np.where(count > 0, self.newest[np.maximum(count - 1, 0)], -np.inf)
        steps_done = np.searchsorted(self.ends, newest + SAME)
        done = np.where(steps_done > 0, self.ends[np.maximum(steps_done - 1, 0)], -np.inf)
        passed = steps_done > step
        late = passed & ((time < done - self.replay - SAME) | (self.replay == 0.0))
        return passed, late, np.where(passed, done - time, 0.0)

    def told(self, name: str, time: FloatArray, passed: Bools, late: Bools, by: FloatArray) -> list[Event]:
        """The events of rows at ``time`` (M,) s that were judged."""
        window = f"the replay window of {self.replay:g} s"
        kinds = (
            ("late", late, f"beyond {window}: not fused" if self.replay else "not fused"),
            ("replayed", passed & ~late, f"within {window}: fused at their own instants"),
        )
        events = []
        for kind, which, done in kinds:
            if which.any():
                text = (
                    f"the filter was up to {float(np.max(by[which])):.6g} s past the instants of rows that came, {done}"
                )
                events.append(Event(float(time[int(np.argmax(which))]), name, kind, text, int(which.sum())))
        return events


def arrivals_of(streams: Sequence[Stream], clock: Sequence[Stream], ends: FloatArray, replay: float) -> Arrivals | None:
    """How a live filter would have fared; None where no stream says when its rows arrived.

    Parameters
    ----------
    streams : sequence of Stream
        Those that are measured.
    clock : sequence of Stream
        Those whose rows move the filter on. A row without an arrival arrives at its instant.
    ends : (K,) array, s
    replay : float, s
    """
    if all(stream.arrival is None for stream in streams):
        return None
    time = np.concatenate([stream.time for stream in clock])
    arrival = np.concatenate([s.arrival if s.arrival is not None else s.time for s in clock])
    order = np.lexsort((time, arrival))
    return Arrivals(arrival[order], np.maximum.accumulate(time[order]), ends, replay)
