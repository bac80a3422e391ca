"""The decentralised recursion: each step is handed to the nodes, through an exchange."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Self

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.decentralised.exchange import Exchange, Participant
from estimfw.estimators.decentralised.node import Node
from estimfw.estimators.decentralised.separate_nodes import LonelyNode, SeparateNode
from estimfw.estimators.decentralised.shares import Share, Snapshot, shares
from estimfw.estimators.decentralised.work import Done, Judgement, Stage, Work
from estimfw.estimators.scan import Chunk, ChunkResult, FilterState, SubSteps
from estimfw.estimators.step_by_step import StepByStep
from estimfw.kernels import joseph
from estimfw.kernels.fuse import FUSED, MISSING
from estimfw.model.nominal import BoundProvider
from estimfw.plan.plan import MeasurementPlan, Plan

__all__ = ["DecentralisedScan"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
NODES: dict[str | None, Callable[[int, Sequence[Share]], Participant]] = {
    None: Node,
    "drop": SeparateNode,
    "decoupled": LonelyNode,
}


class DecentralisedScan(StepByStep):
    """The recursion over a plan that is cut into subsystems.

    The covariance goes from one step to the next as it is. What all nodes share, the model and the nominal, is made here once.

    Parameters
    ----------
    plan : Plan
        With ``subsystems``.
    provider, initial_row, prior
        See `StepByStep`.
    closed_loop : bool
        See `estimfw.estimators.scan.FilterSettings`; the nominal is corrected by what all nodes know after a step.
    exchange : Exchange
    """

    def __init__(
        self,
        plan: Plan,
        provider: BoundProvider | None,
        closed_loop: bool,
        exchange: Exchange,
        initial_row: FloatArray,
        prior: tuple[FloatArray, FloatArray],
    ) -> None:
        super().__init__(plan, provider, joseph, initial_row, prior)
        assert plan.subsystems is not None
        self.closed_loop, self.exchange, self.subsystems = closed_loop, exchange, plan.subsystems
        held = shares([node.states for node in self.subsystems.nodes])
        kind = NODES[None if plan.separation is None else plan.separation.form]
        self.nodes: list[Participant] = [kind(i, held) for i in range(len(held))]
        self.owners = [self.subsystems.owner(j) for j in range(len(plan.measurements))]
        self.reads = [_reads(m) for m in plan.measurements]
        self.noise = [(pair.first, pair.second, np.array(pair.R)) for pair in self.subsystems.noise]

    def begun(self, doublings: SubSteps, mean: FloatArray, form: FloatArray) -> Self:
        """See `StepByStep.begun`; its exchange counts for itself."""
        return super().begun(doublings, mean, form).through(self.exchange.fresh())

    def through(self, exchange: Exchange) -> Self:
        """The same recursion through another exchange."""
        other = copy(self)
        other.exchange = exchange
        return other

    def _step(self, state: FilterState, chunk: Chunk, k: int, result: ChunkResult) -> FilterState:
        x, P, provider = state.x, state.form, state.provider
        process_row = end_row = self._complete(state.row)
        if chunk.restart[k]:
            provider = self._correct(provider, x, end_row)
            x, P = self.mean.copy(), self.form.copy()
        if self.provider is not None:
            provider, process_row, end_row = self.provider.step(provider, chunk.samples[k])
            process_row, end_row = self._complete(process_row), self._complete(end_row)
        dt = float(chunk.dt[k])
        transition = self._tables(process_row, chunk.inputs[k], dt) if dt > 0.0 else None
        done = self._exchanged(Snapshot(x, P), transition, end_row, chunk, k)
        x, P = self._whole(done)
        any_fused = self._tell(done, result, k)
        result.estimate[k], result.covariance[k] = x, P
        result.rows[k], result.provider[k] = end_row[: self.plan.layout.provided], provider
        if self.closed_loop and any_fused and self.provider is not None:
            provider = self._correct(provider, x, end_row)
            x = np.where(self.corrected, 0.0, x)
        return FilterState(x, P, provider, end_row[: self.plan.layout.provided])

    def _exchanged(
        self,
        snapshot: Snapshot,
        transition: tuple[FloatArray, FloatArray, FloatArray] | None,
        row: FloatArray,
        chunk: Chunk,
        k: int,
    ) -> list[Done]:
        """The step in the nodes; what is due of a silent one is told as missing."""
        time = float(chunk.time[k])
        away = self.exchange.silent(time)
        due = [j for j in range(len(self.plan.measurements)) if chunk.due[k, j]]
        stages, readings = [], [dict[int, FloatArray]() for _ in self.nodes]
        for j in due:
            if self.owners[j] not in away:
                m, own = self.plan.measurements[j], slice(self.offsets[j], self.offsets[j + 1])
                readings[self.owners[j]][j] = m.innovation.evaluate(row)[..., 0] + m.sign * chunk.readings[k, own]
                stages.append(self._stage(j, m, row, float(chunk.interval[k, j])))
        work = Work(transition, tuple(stages), self._noise_between(readings, chunk.interval[k]))
        done = list(self.exchange.step(time, self.nodes, snapshot, work, readings))
        lost = {j: _not_there(self.plan.measurements[j]) for j in due if self.owners[j] in away}
        return [*done, Done(snapshot, lost)] if lost else done

    def _stage(self, j: int, m: MeasurementPlan, row: FloatArray, interval: float) -> Stage:
        R = np.array(m.R) / (interval if m.density else 1.0)
        return Stage(j, self.owners[j], m.H.evaluate(row), R, self.reads[j], self.thresholds[j], m.period)

    def _noise_between(
        self, readings: list[dict[int, FloatArray]], interval: FloatArray
    ) -> dict[tuple[int, int], FloatArray]:
        due = {j for own in readings for j in own}
        return {
            (a, b): R / (interval[a] if self.plan.measurements[a].density else 1.0)
            for a, b, R in self.noise
            if a in due and b in due
        }

    def _whole(self, done: list[Done]) -> tuple[FloatArray, FloatArray]:
        """x and P, of each node what it says of its own states."""
        x, P = np.empty(len(self.plan.states)), np.empty((len(self.plan.states),) * 2)
        for node, one in zip(self.subsystems.nodes, done, strict=False):
            own = list(node.states)
            x[own], P[own] = one.snapshot.x[own], one.snapshot.P[own]
        return x, P

    def _tell(self, done: list[Done], result: ChunkResult, k: int) -> bool:
        """Write what became of the measurements; whether any was fused."""
        any_fused = False
        for j, one in ((j, judged) for each in done for j, judged in each.judged.items()):
            own = slice(self.offsets[j], self.offsets[j + 1])
            result.innovation[k, own], result.sigma[k, own] = one.innovation, one.sigma
            result.nis[k, j], result.disposition[k, j], result.used[k, j] = one.nis, one.disposition, one.used
            result.log_det[k, j] = one.log_det
            any_fused = any_fused or one.disposition == FUSED
        return any_fused


def _reads(m: MeasurementPlan) -> BoolArray:
    """Which states each row reads, at any nominal."""
    reads = np.zeros(m.H.shape, dtype=bool)
    reads.ravel()[[entry for entry, _, _ in m.H.monomials]] = True
    return reads


def _not_there(m: MeasurementPlan) -> Judgement:
    nothing = np.full(m.rows, np.nan)
    return Judgement(MISSING, nothing, nothing, np.nan, 0, np.nan)
