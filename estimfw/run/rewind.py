"""What a session keeps of its last steps, to go back to before one of them: bounded by the replay window.

A snapshot is the state of the filter (`estimfw.estimators.scan.FilterState`) and what else goes from one step to the next: rows
that wait, inputs that are held, counts.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME, Event
from estimfw.errors import DataError
from estimfw.estimators.scan import FilterState
from estimfw.run.health import Judges
from estimfw.run.held_inputs import HeldInputs
from estimfw.run.session_health import Watched
from estimfw.run.waiting_rows import WaitingRows

if TYPE_CHECKING:
    from estimfw.run.session import Estimate

__all__ = ["Arrived", "Done", "History", "Snapshot"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A session between two steps; nothing in it is changed by what the session does afterwards."""

    time: float
    steps: int
    states: list[FilterState]
    score: FloatArray
    last: Estimate | None
    rows: WaitingRows
    inputs: HeldInputs
    counts: dict[str, Counter[str]]
    ticks: dict[str, int]
    restarts: list[float]
    lengths: dict[float, float]
    watched: Watched
    acting: tuple[Judges, ...]
    anew: bool


@dataclass(frozen=True, slots=True)
class Arrived:
    """A row that was handed over."""

    stream: str
    time: float
    values: FloatArray


@dataclass(slots=True)
class Done:
    """A step that was done.

    ``before`` is the session before it, ``asked`` whether its end was asked for (and does not come from a row), ``arrived`` what
    came between the step before and it, ``events`` what it told.
    """

    before: Snapshot
    time: float
    dt: float
    samples: FloatArray
    asked: bool
    arrived: list[Arrived]
    events: list[Event] = field(default_factory=list)


class History:
    """The steps of the last ``window`` s, and the rows that came since the last of them."""

    def __init__(self, window: float) -> None:
        self.window = window
        self.pending: list[Arrived] = []
        self._done: deque[Done] = deque()

    def __len__(self) -> int:
        return len(self._done)

    def add(self, done: Done) -> None:
        """One more step; those that nobody can go back to are forgotten."""
        self._done.append(done)
        while self._done and self._done[0].time < done.time - self.window - SAME:
            self._done.popleft()

    def reaches(self, time: float, now: float) -> bool:
        """Whether a row of this instant can still be fused by going back."""
        if not self._done or time < now - self.window - SAME:
            return False
        oldest = self._done[0].before
        return oldest.last is None or time > oldest.time + SAME

    def knows(self, row: Arrived) -> bool:
        """Whether that row came already; DataError if another one of its stream has its time."""
        for other in self._rows():
            if other.stream == row.stream and abs(other.time - row.time) <= SAME:
                if np.array_equal(other.values, row.values, equal_nan=True):
                    return True
                raise DataError(f"stream {row.stream!r}: two rows have one time, {row.time:g} s, but differ")
        return False

    def undone(self, time: float) -> list[Done]:
        """Take back the step in which an instant lies, and all after it."""
        kept = [one for one in self._done if one.time < time - SAME]
        taken = list(self._done)[len(kept) :]
        self._done = deque(kept)
        return taken

    def _rows(self) -> Iterator[Arrived]:
        yield from self.pending
        for one in self._done:
            yield from one.arrived
