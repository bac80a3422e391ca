"""The programs of suboptimal forms: nodes that keep no covariance between them; see `estimfw.plan.separation`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.decentralised.exchange import Message, Program
from estimfw.estimators.decentralised.judge import FLOATS
from estimfw.estimators.decentralised.shares import Share, Snapshot
from estimfw.estimators.decentralised.work import Arithmetic, Done, Judgement, Readings, Stage, Work
from estimfw.kernels.fuse import FUSED

__all__ = ["LonelyNode", "SeparateNode"]

FloatArray = NDArray[np.float64]


class SeparateNode:
    """Form ``drop``: a node predicts from all x_j and P_jj, and corrects its own states by its own measurements, at once.

    Its measurements read its own states alone. One round a step: each node sends x_i and P_ii.

    Parameters
    ----------
    index : int
    shares : sequence of Share
        Of all nodes.
    arithmetic : Arithmetic
    """

    def __init__(self, index: int, shares: Sequence[Share], arithmetic: Arithmetic = FLOATS) -> None:
        self.index, self.shares, self.arithmetic = index, tuple(shares), arithmetic
        self.states = self.shares[index].states

    def snapshot_words(self) -> int:
        """x and the upper triangles of all P_jj."""
        return sum(len(s.states) * (len(s.states) + 3) // 2 for s in self.shares)

    def program(self, snapshot: Snapshot, work: Work, readings: Readings) -> Program:
        """One step."""
        x, P, judged = self._alone(snapshot, work, readings)
        mailbox = yield Message({"state": x, "covariance": P[self.shares[self.index].upper]})
        known = self.arithmetic.zeros(snapshot.x.shape), self.arithmetic.zeros(snapshot.P.shape)
        for share, message in zip(self.shares, mailbox, strict=True):
            known[0][share.states] = message.words["state"]
            rows, columns = (share.states[k] for k in share.upper)
            known[1][rows, columns] = message.words["covariance"]
            known[1][columns, rows] = message.words["covariance"]
        return Done(Snapshot(*known), judged)

    def _alone(
        self, snapshot: Snapshot, work: Work, readings: Readings
    ) -> tuple[FloatArray, FloatArray, dict[int, Judgement]]:
        """x_i and P_ii predicted and corrected by its own measurements, and what became of these."""
        (x, P), judged = self._predicted(snapshot, work), dict[int, Judgement]()
        for stage in work.stages:
            if stage.owner == self.index:
                x, P, judged[stage.place] = self._updated(x, P, stage, readings[stage.place])
        return x, P, judged

    def _predicted(self, snapshot: Snapshot, work: Work) -> tuple[FloatArray, FloatArray]:
        own = np.ix_(self.states, self.states)
        if work.transition is None:
            return snapshot.x[self.states], snapshot.P[own]
        Phi, Q, d = work.transition
        P = Q[own]
        for share in self.shares:
            couples = Phi[np.ix_(self.states, share.states)]
            P = P + self.arithmetic.symmetric(couples @ snapshot.P[np.ix_(share.states, share.states)], couples)
        return Phi[self.states] @ snapshot.x + d[self.states], P

    def _updated(
        self, x: FloatArray, P: FloatArray, stage: Stage, z: FloatArray
    ) -> tuple[FloatArray, FloatArray, Judgement]:
        """With one measurement of its own."""
        H, usable = stage.H[:, self.states], self.arithmetic.finite(z)
        M = P @ H.T
        S, (_, nu) = H @ M + stage.R, stage.around(z, z - H @ x)
        judged = self.arithmetic.judge(nu, S, stage.R, usable, stage.thresholds)
        if judged.disposition != FUSED:
            return x, P, judged
        K = M[:, usable] @ self.arithmetic.inverse(S[np.ix_(usable, usable)])
        left = P - self.arithmetic.symmetric(K, M[:, usable])
        left = self.arithmetic.guard(left, P, K, stage.R[np.ix_(usable, usable)])
        return x + K @ nu[usable], left, judged


class LonelyNode(SeparateNode):
    """Form ``decoupled``: a filter alone, which neither sends nor hears; of other nodes' states it knows nothing."""

    def program(self, snapshot: Snapshot, work: Work, readings: Readings) -> Program:
        """One step, without any round."""
        x, P, judged = self._alone(snapshot, work, readings)
        known = self.arithmetic.zeros(snapshot.x.shape), self.arithmetic.zeros(snapshot.P.shape)
        known[0][self.states], known[1][np.ix_(self.states, self.states)] = x, P
        return Done(Snapshot(*known), judged)
        yield  # a program is a generator, also one that has nothing to say

    def _predicted(self, snapshot: Snapshot, work: Work) -> tuple[FloatArray, FloatArray]:
        own = np.ix_(self.states, self.states)
        x, P = snapshot.x[self.states], snapshot.P[own]
        if work.transition is None:
            return x, P
        Phi, Q, d = work.transition
        return Phi[own] @ x + d[self.states], self.arithmetic.symmetric(Phi[own] @ P, Phi[own]) + Q[own]
