"""The program of a node of the exact filter."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.decentralised.exchange import Mailbox, Message, Program
from estimfw.estimators.decentralised.judge import FLOATS
from estimfw.estimators.decentralised.noise import Decorrelation
from estimfw.estimators.decentralised.routes import Route, route
from estimfw.estimators.decentralised.shares import Held, Share, Snapshot, upper_triangle
from estimfw.estimators.decentralised.work import Arithmetic, Done, Judgement, Readings, Stage, Work
from estimfw.kernels.fuse import FUSED

__all__ = ["Node"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
NOTHING = np.zeros(0)


class Node:
    """One subsystem.

    Parameters
    ----------
    index : int
        Which of the nodes it is.
    shares : sequence of Share
        Of all nodes: each knows what the others hold, and so what their words mean.
    arithmetic : Arithmetic
    """

    def __init__(self, index: int, shares: Sequence[Share], arithmetic: Arithmetic = FLOATS) -> None:
        self.index, self.shares, self.arithmetic = index, tuple(shares), arithmetic
        self.share = self.shares[index]
        self._routes: dict[bytes, tuple[Route, ...]] = {}

    def snapshot_words(self) -> int:
        """x and the upper triangle of P."""
        n = sum(len(share.states) for share in self.shares)
        return n + n * (n + 1) // 2

    def program(self, snapshot: Snapshot, work: Work, readings: Readings) -> Program:
        """One step, as `estimfw.estimators.decentralised` describes it."""
        held, judged = self._predicted(snapshot, work), dict[int, Judgement]()
        noise, sent = Decorrelation.of(work), dict[int, FloatArray]()
        for place in [stage.place for stage in work.stages]:
            stage = noise.stages[place]
            y = noise.reading(place, readings[place], sent) if stage.owner == self.index else None
            M, told = yield from self._stage(stage, held, y, bool(noise.later(place)), judged)
            if told.disposition == FUSED and told.usable is not None:
                held = self._updated(held, M, told.words["inverse"], told.words["innovation"], stage.R)
                sent[place] = told.words.get("reading", NOTHING)
                noise.fused(place, told.usable)
        mailbox = yield Message({"state": held.x, "covariance": self.share.packed(held)})
        return Done(self._assembled(mailbox, len(snapshot.x)), judged)

    def _predicted(self, snapshot: Snapshot, work: Work) -> Held:
        own, P = self.share.states, snapshot.P
        if work.transition is None:
            return Held(snapshot.x[own], tuple(P[b.rows[:, None], b.columns] for b in self.share.blocks))
        Phi, Q, d = work.transition
        mine = Phi[own]
        T, blocks = mine @ P, list[FloatArray]()
        for b, block in enumerate(self.share.blocks):
            if b == 0:
                moved = self.arithmetic.symmetric(T, mine)
            elif block.own_rows:
                moved = T[block.place] @ Phi[block.columns].T
            else:
                moved = (T @ Phi[block.rows].T).T
            blocks.append(moved + Q[block.rows[:, None], block.columns])
        return Held(mine @ snapshot.x + d[own], tuple(blocks))

    def _stage(
        self, stage: Stage, held: Held, y: FloatArray | None, wanted: bool, judged: dict[int, Judgement]
    ) -> Generator[Message, Mailbox, tuple[FloatArray, Message]]:
        """One measurement: M of all states, and what its owner tells. ``y`` is its reading, None in all other nodes.

        ``wanted``: later measurements need to know the reading.
        """
        routes = self._routes_of(stage)
        mine = routes[self.index]
        M = self._projection(stage, held, mine)
        message = Message({"projection": M[mine.sends]})
        local = not any(r.reads for i, r in enumerate(routes) if i != stage.owner)
        if local:  # the owner has all that its S is made of: one round
            if y is not None:
                message = self._told(stage, y, y - self._reading(stage, held), M, wanted, judged, message.words)
            mailbox = yield message
            return self._summed(mailbox, routes, stage), mailbox[stage.owner]
        if mine.reads and y is None:
            message = Message({**message.words, "predicted reading": self._reading(stage, held)})
        mailbox = yield message
        M, message = self._summed(mailbox, routes, stage), Message()
        if y is not None:
            nu = y - self._reading(stage, held)
            for part in (m.words["predicted reading"] for m in mailbox if "predicted reading" in m.words):
                nu = nu - part
            message = self._told(stage, y, nu, M, wanted, judged, {})
        mailbox = yield message
        return M, mailbox[stage.owner]

    def _reading(self, stage: Stage, held: Held) -> FloatArray:
        """What this node's states make of the reading."""
        return stage.H[:, self.share.states] @ held.x

    def _routes_of(self, stage: Stage) -> tuple[Route, ...]:
        key = stage.reads.tobytes()
        if key not in self._routes:
            self._routes[key] = route(self.shares, stage.reads)
        return self._routes[key]

    def _projection(self, stage: Stage, held: Held, own: Route) -> FloatArray:
        """What the entries held make of M = P H', (n, m)."""
        M = self.arithmetic.zeros(stage.H.T.shape)
        for piece in own.pieces:
            block = held.blocks[piece.block]
            M[piece.into] += (block.T if piece.transposed else block) @ stage.H[:, piece.of].T
        return M

    def _summed(self, mailbox: Mailbox, routes: Sequence[Route], stage: Stage) -> FloatArray:
        """M from the words of all nodes, summed in the same order everywhere."""
        M = self.arithmetic.zeros(stage.H.T.shape)
        for message, one in zip(mailbox, routes, strict=True):
            M[one.sends] += message.words["projection"]
        return M

    def _told(
        self,
        stage: Stage,
        y: FloatArray,
        nu: FloatArray,
        M: FloatArray,
        wanted: bool,
        judged: dict[int, Judgement],
        words: Mapping[str, FloatArray],
    ) -> Message:
        """The owner's message: ``words``, and nu, S^-1 and, where ``wanted``, y, if the measurement is fused."""
        y, nu = stage.around(y, nu)
        read = self._read_blocks(stage)
        S = stage.H[:, read] @ M[read] + stage.R
        usable = self.arithmetic.finite(y)
        judgement = judged[stage.place] = self.arithmetic.judge(nu, S, stage.R, usable, stage.thresholds)
        if judgement.disposition != FUSED:
            return Message(words, judgement.disposition, usable)
        told = {**words, "innovation": self._masked(nu, usable), "inverse": self._inverse(S, usable)}
        if wanted:
            told["reading"] = self._masked(y, usable)
        return Message(told, FUSED, usable)

    def _read_blocks(self, stage: Stage) -> NDArray[np.int64]:
        """The states of the nodes that a measurement reads."""
        read = [s.states for s, r in zip(self.shares, self._routes_of(stage), strict=True) if r.reads]
        return np.concatenate(read or [self.share.states])

    def _masked(self, values: FloatArray, usable: BoolArray) -> FloatArray:
        if np.all(usable):
            return values
        made = self.arithmetic.zeros(values.shape)
        made[usable] = values[usable]
        return made

    def _inverse(self, S: FloatArray, usable: BoolArray) -> FloatArray:
        """The upper triangle of S^-1, zero where a component is not usable."""
        if np.all(usable):
            return self.arithmetic.inverse(S)[upper_triangle(len(S))]
        whole, own = self.arithmetic.zeros(S.shape), np.ix_(usable, usable)
        whole[own] = self.arithmetic.inverse(S[own])
        return whole[upper_triangle(len(S))]

    def _updated(self, held: Held, M: FloatArray, inverse: FloatArray, nu: FloatArray, R: FloatArray) -> Held:
        own, m = self.share.states, len(nu)
        S = np.empty((m, m), dtype=inverse.dtype)
        rows, columns = upper_triangle(m)
        S[rows, columns] = inverse
        S[columns, rows] = inverse
        K, blocks = M[own] @ S, list[FloatArray]()
        for b, (block, P) in enumerate(zip(self.share.blocks, held.blocks, strict=True)):
            if b == 0:
                taken = self.arithmetic.symmetric(K, M[own])
            elif block.own_rows:
                taken = K[block.place] @ M[block.columns].T
            else:
                taken = M[block.rows] @ K.T
            blocks.append(P - taken)
        blocks[0] = self.arithmetic.guard(blocks[0], held.blocks[0], K, R)
        return Held(held.x + K @ nu, tuple(blocks))

    def _assembled(self, mailbox: Mailbox, n: int) -> Snapshot:
        x, P = self.arithmetic.zeros((n,)), self.arithmetic.zeros((n, n))
        for share, message in zip(self.shares, mailbox, strict=True):
            x[share.states] = message.words["state"]
            share.unpack_into(P, message.words["covariance"])
        return Snapshot(x, P)
