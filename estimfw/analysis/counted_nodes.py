"""One step of the nodes of a decentralised filter on numbers that count: what each does in each round, and the words it sends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.counted_number import Counted, Objects, Tally
from estimfw.analysis.filter_forms import StepArrays, inverse
from estimfw.estimators.decentralised.exchange import Program, lockstep
from estimfw.estimators.decentralised.judge import mirrored
from estimfw.estimators.decentralised.ledger import Ledger
from estimfw.estimators.decentralised.node import Node
from estimfw.estimators.decentralised.shares import Snapshot, shares
from estimfw.estimators.decentralised.work import Arithmetic, Judgement, Stage, Work
from estimfw.kernels.fuse import FUSED

__all__ = ["CountedStep", "counted_step"]

BoolArray = NDArray[np.bool_]
Groups = Sequence[Sequence[int]]


@dataclass(frozen=True, slots=True)
class CountedStep:
    """A step of all nodes.

    Attributes
    ----------
    x, P : (n,), (n, n) array
        After it.
    products : (nodes, rounds) array of int
        Multiplications of each node, up to each exchange and after the last.
    words : int
        Numbers sent, each once.
    rounds : int
        Exchanges, in which all wait for each other.
    """

    x: Objects
    P: Objects
    products: NDArray[np.int64]
    words: int
    rounds: int

    @property
    def total(self) -> int:
        return int(self.products.sum())

    @property
    def longest(self) -> int:
        """Of the busiest node between two exchanges, added up: what nobody can do at the same time as another."""
        return int(self.products.max(axis=0).sum())


def counted_step(
    step: StepArrays, tally: Tally, groups: Groups, rows: Groups, reads: BoolArray, *, triangular: bool = False
) -> CountedStep:
    """Run the nodes.

    Parameters
    ----------
    step : StepArrays
        Of numbers that write to ``tally``; R is zero between rows of different nodes.
    groups, rows : sequence of sequence of int
        States, and rows of the measurement, of each node.
    reads : (m, n) array of bool
        Which states each row reads.
    triangular : bool
        Of what is symmetric by itself one half is computed, the cheaper one.
    """
    n, held = len(step.x), shares(groups)
    arithmetic = _counting(tally, triangular=triangular)
    stages = tuple(
        Stage(node, node, step.H[own], step.R[np.ix_(own, own)], reads[own])
        for node, own in enumerate(map(list, rows))
        if own
    )
    work = Work((step.Phi, step.Q, arithmetic.zeros((n,))), stages)
    spent: list[list[int]] = [[] for _ in groups]
    programs = [
        _watched(
            Node(i, held, arithmetic).program(Snapshot(step.x, step.P), work, {i: step.z[list(own)]}), tally, spent[i]
        )
        for i, own in enumerate(rows)
    ]
    ledger = Ledger(tuple(f"node_{i + 1}" for i in range(len(groups))))
    done = lockstep(programs, range(len(groups)), ledger)
    return CountedStep(done[0].snapshot.x, done[0].snapshot.P, np.array(spent), ledger.total, ledger.rounds)


def _watched(program: Program, tally: Tally, spent: list[int]) -> Program:
    """The same program; ``spent`` gets the products that it makes between its messages."""
    mailbox = None
    while True:
        before = tally.products
        try:
            message = program.send(mailbox)  # type: ignore[arg-type]
        except StopIteration as end:
            spent.append(tally.products - before)
            return end.value  # type: ignore[no-any-return]
        spent.append(tally.products - before)
        mailbox = yield message


def _counting(tally: Tally, *, triangular: bool) -> Arithmetic:
    zero = Counted(0.0, tally, known=True)

    def zeros(shape: tuple[int, ...]) -> Objects:
        return np.full(shape, zero, dtype=object)

    def symmetric(A: Objects, B: Objects) -> Objects:
        return _cheaper_half(A, B, tally) if triangular else mirrored(A @ B.T)

    def judge(nu: Objects, S: Objects, R: Objects, usable: BoolArray, thresholds: object) -> Judgement:
        return Judgement(FUSED, nu, nu, np.nan, len(nu), np.nan)

    return Arithmetic(inverse, symmetric, judge, zeros, lambda z: np.ones(z.shape, dtype=bool))


def _cheaper_half(A: Objects, B: Objects, tally: Tally) -> Objects:
    """A B', which is symmetric, from its upper or its lower half: only the cheaper one counts."""
    before = tally.products
    made, n = np.empty((len(A), len(A)), dtype=object), len(A)
    for i in range(n):
        made[i, : i + 1] = B[: i + 1] @ A[i]
    lower = tally.products - before
    for i in range(n):
        made[i, i:] = B[i:] @ A[i]
    tally.products = before + min(lower, tally.products - before - lower)
    return mirrored(made)
