"""Who sent which words: what an exchange counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Absence", "Ledger"]

FloatArray = NDArray[np.float64]


@dataclass
class Absence:
    """A node did not answer from the step that ends at ``first`` to the one at ``last`` (s); ``deputies`` ran its program.

    There is none for steps at which no node answered.
    """

    node: int
    first: float
    last: float
    steps: int
    deputies: list[int]


@dataclass
class Ledger:
    """Counts of one run.

    Attributes
    ----------
    names : tuple of str
        Of the nodes.
    steps : int
    rounds : int
        Synchronisations: all nodes wait for each other.
    messages : list of int
        By node; a message goes to all others, and is counted once.
    words : list of Counter
        By node, and by what they are: numbers sent, each counted once.
    absences : list of Absence
    """

    names: tuple[str, ...]
    steps: int = 0
    rounds: int = 0
    messages: list[int] = field(default_factory=list)
    words: list[Counter[str]] = field(default_factory=list)
    absences: list[Absence] = field(default_factory=list)
    _open: dict[int, Absence] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.messages = [0 for _ in self.names]
        self.words = [Counter() for _ in self.names]

    @property
    def total(self) -> int:
        """All words."""
        return sum(own.total() for own in self.words)

    def round(self, acting: Sequence[int], sent: Sequence[Mapping[str, FloatArray]]) -> None:
        """A round: what each program sent, and which node ran it. A node that is alone sends nothing."""
        if len(set(acting)) == 1:
            return
        self.rounds += 1
        for node in {node for node, words in zip(acting, sent, strict=True) if words}:
            self.messages[node] += 1
        for node, words in zip(acting, sent, strict=True):
            own = self.words[node]
            for kind, array in words.items():
                own[kind] += array.size

    def sent(self, node: int, kind: str, words: int) -> None:
        """A message outside the rounds."""
        self.messages[node] += 1
        self.words[node][kind] += words

    def absent(self, node: int, time: float, deputy: int | None) -> None:
        """A node did not answer at the step that ends at this time, s; ``deputy`` ran its program, None: nobody."""
        known = self._open.get(node)
        if known is None:
            known = self._open[node] = Absence(node, time, time, 0, [])
            self.absences.append(known)
        if deputy is not None and deputy not in known.deputies:
            known.deputies.append(deputy)
        known.last, known.steps = time, known.steps + 1

    def back(self, node: int) -> None:
        """A node that was absent answers again."""
        self._open.pop(node, None)
