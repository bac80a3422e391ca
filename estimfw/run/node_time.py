"""How long the nodes of a decentralised filter take for a step, each between two exchanges, beside one node that has all."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from estimfw.analysis.suboptimal import LinearStep
from estimfw.estimators.decentralised.exchange import Program, lockstep
from estimfw.estimators.decentralised.ledger import Ledger
from estimfw.estimators.decentralised.node import Node
from estimfw.estimators.decentralised.shares import Snapshot, shares
from estimfw.estimators.decentralised.work import Stage, Work

__all__ = ["NodeTimes", "node_times"]

FloatArray = NDArray[np.float64]
Groups = Sequence[Sequence[int]]

#: Steps that are timed at most, in a turn.
MOST_STEPS = 10


@dataclass(frozen=True, slots=True)
class NodeTimes:
    """Seconds a step; each stretch between two exchanges is the shortest of several turns.

    Attributes
    ----------
    one : float
        One node that owns all: the global filter by the same code.
    together : float
        All nodes, one after the other on one processor.
    busiest : float
        The node that takes longest between two exchanges, added up: what a processor for each would take, without communication.
    """

    one: float
    together: float
    busiest: float


def node_times(
    steps: Sequence[LinearStep], groups: Groups, rows: Groups, prior: tuple[FloatArray, FloatArray], turns: int = 9
) -> NodeTimes:
    """Time both by turns over the same steps, on one thread, so that a busy machine slows both alike; what another
    program takes of a stretch in one turn, it does not in the next.

    Parameters
    ----------
    steps : sequence of LinearStep
        With all rows of the plan.
    groups, rows : sequence of sequence of int
        States and rows of each node.
    prior : (n,) and (n, n) array
    turns : int
    """
    several, alone = _Timed(groups, rows), _Timed([range(len(prior[0]))], [sorted(r for own in rows for r in own)])
    own = steps[:MOST_STEPS]
    with threadpool_limits(1, user_api="blas"):
        made = [(alone.run(own, prior), several.run(own, prior)) for _ in range(turns)]
    one, each = (np.min(np.stack(of), axis=0) for of in zip(*made, strict=True))
    count = len(own)
    return NodeTimes(float(one.sum()) / count, float(each.sum()) / count, float(each.max(axis=1).sum()) / count)


class _Timed:
    """Nodes that own these states and rows."""

    def __init__(self, groups: Groups, rows: Groups) -> None:
        held = shares(groups)
        self.nodes = [Node(i, held) for i in range(len(groups))]
        self.rows = [list(own) for own in rows]
        self.names = tuple(str(i) for i in range(len(groups)))

    def run(self, steps: Sequence[LinearStep], prior: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Seconds (steps x rounds, nodes) between exchanges."""
        snapshot, ledger, spent = Snapshot(*prior), Ledger(self.names), list[FloatArray]()
        for step in steps:
            work = self._work(step)
            each: list[list[float]] = [[] for _ in self.nodes]
            programs = [
                _timed(node.program(snapshot, work, {i: np.zeros(len(self.rows[i]))}), each[i])
                for i, node in enumerate(self.nodes)
            ]
            snapshot = lockstep(programs, range(len(self.nodes)), ledger)[0].snapshot
            spent.append(np.array(each).T)
        return np.concatenate(spent)

    def _work(self, step: LinearStep) -> Work:
        stages = [
            Stage(node, node, step.H[own], step.R[np.ix_(own, own)], step.H[own] != 0.0)
            for node, own in enumerate(self.rows)
            if own
        ]
        return Work((step.Phi, step.Q, step.d), tuple(stages))


def _timed(program: Program, spent: list[float]) -> Program:
    """The same program; ``spent`` gets the seconds between its messages."""
    mailbox = None
    while True:
        begin = time.perf_counter()
        try:
            message = program.send(mailbox)  # type: ignore[arg-type]
        except StopIteration as end:
            spent.append(time.perf_counter() - begin)
            return end.value  # type: ignore[no-any-return]
        spent.append(time.perf_counter() - begin)
        mailbox = yield message
