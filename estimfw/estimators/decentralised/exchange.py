"""The exchange carries messages between nodes, and counts them. Its in-process form drives all nodes in lockstep.

A node's program for a step is a generator: it yields the message of a round, and is sent the messages of all nodes in that
round. It does not know what carries them. An exchange over processes gives each process its node, its readings and the snapshot,
and does there what `lockstep` does here for all: ``mailbox = transport(message); message = program.send(mailbox)``.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME
from estimfw.estimators.decentralised.ledger import Ledger
from estimfw.estimators.decentralised.shares import Snapshot
from estimfw.estimators.decentralised.work import Done, Readings, Work

__all__ = ["Exchange", "InProcessExchange", "Mailbox", "Message", "Participant", "Program", "Silence", "lockstep"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Message:
    """What a node sends in a round.

    ``words`` by what they are; empty where it has nothing to say. ``disposition`` and ``usable`` (m,) stand in the head of the
    message of a measurement's owner: what became of it, and which components it has. They are bits, and are not counted.
    """

    words: Mapping[str, FloatArray] = field(default_factory=dict)
    disposition: int = -1
    usable: BoolArray | None = None


Mailbox = Sequence[Message]
"""The messages of a round, by node."""
Program = Generator[Message, Mailbox, Done]


class Participant(Protocol):
    """A node, as an exchange sees it."""

    def program(self, snapshot: Snapshot, work: Work, readings: Readings) -> Program: ...

    def snapshot_words(self) -> int:
        """How many words bring a node that was away up to date."""
        ...


class Exchange(Protocol):
    """Carries the messages of one step after the other.

    Attributes
    ----------
    ledger : Ledger
    """

    ledger: Ledger

    def silent(self, time: float) -> frozenset[int]:
        """The nodes that do not answer at the step that ends at this time (s)."""
        ...

    def step(
        self, time: float, nodes: Sequence[Participant], snapshot: Snapshot, work: Work, readings: Sequence[Readings]
    ) -> Sequence[Done]:
        """Let all nodes do a step; ``readings`` are those of each node."""
        ...

    def fresh(self) -> Exchange:
        """The same exchange for another run, with nothing in its ledger."""
        ...


@dataclass(frozen=True, slots=True)
class Silence:
    """A node does not answer at the steps that end in [begin, end), s."""

    node: int
    begin: float
    end: float


class InProcessExchange:
    """All nodes in this process, in lockstep.

    A node that is silent has its program run by the next one that answers, without its readings: each node begins a step with
    the whole of x and P, so nothing is lost. When it is back it is sent a snapshot. Where no node answers, the first that is back
    makes up for the steps in between, without readings, from the snapshot that it has: nothing is sent for them.

    Parameters
    ----------
    names : sequence of str
        Of the nodes.
    silences : sequence of Silence
    """

    def __init__(self, names: Sequence[str], silences: Sequence[Silence] = ()) -> None:
        self.names, self.silences = tuple(names), tuple(silences)
        self.ledger = Ledger(self.names)
        self._away: frozenset[int] = frozenset()

    def fresh(self) -> InProcessExchange:
        return InProcessExchange(self.names, self.silences)

    def silent(self, time: float) -> frozenset[int]:
        if not self.silences:
            return frozenset()
        return frozenset(s.node for s in self.silences if s.begin - SAME <= time < s.end - SAME)

    def step(
        self, time: float, nodes: Sequence[Participant], snapshot: Snapshot, work: Work, readings: Sequence[Readings]
    ) -> Sequence[Done]:
        """See `Exchange.step`."""
        away, everybody = self.silent(time), len(nodes)
        acting = self._acting(away)
        for back in sorted(self._away - away):
            self.ledger.back(back)
            if len(self._away) < everybody:
                self.ledger.sent(acting[(back + 1) % everybody], "snapshot", nodes[back].snapshot_words())
        for node in sorted(away):
            self.ledger.absent(node, time, acting[node] if len(away) < everybody else None)
        self._away = away
        programs = [node.program(snapshot, work, own) for node, own in zip(nodes, readings, strict=True)]
        done = lockstep(programs, acting, self.ledger if len(away) < everybody else Ledger(self.names))
        self.ledger.steps += 1
        return done

    def _acting(self, away: frozenset[int]) -> list[int]:
        """Which node runs each program; each its own where none answers."""
        count = len(self.names)
        if len(away) == count:
            return list(range(count))
        return [next(j % count for j in range(i, i + count) if j % count not in away) for i in range(count)]


def lockstep(programs: Sequence[Program], acting: Sequence[int], ledger: Ledger) -> list[Done]:
    """Drive programs round by round to their end; ``acting`` says which node runs each of them."""
    mailbox: Mailbox | None = None
    done: list[Done] = []
    while True:
        messages: list[Message] = []
        for program in programs:
            try:
                messages.append(program.send(mailbox))  # type: ignore[arg-type]
            except StopIteration as end:
                done.append(end.value)
        if not messages:
            return done
        if done:
            raise RuntimeError("the programs of a step end in different rounds")
        ledger.round(acting, [message.words for message in messages])
        mailbox = messages
