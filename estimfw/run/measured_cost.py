"""Measured times of a step beside the counted work: the global filter and the decentralised one, run over one record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimfw.analysis.dense_cost import CutSizes, decentralised_cost
from estimfw.config.compose import Problem
from estimfw.errors import DataError
from estimfw.run.both_forms import both_forms
from estimfw.run.cost import CutCost, nodes_of
from estimfw.run.kept_steps import KeptSteps
from estimfw.run.needs_states import refuse_bank, refuse_stages
from estimfw.run.node_time import NodeTimes, node_times
from estimfw.run.prepare import Prepared
from estimfw.run.run import Progress, run_problem
from estimfw.run.step_time import StepTime, step_times

__all__ = ["TURNS", "Measured", "measure"]

TURNS = 9

#: Turns and steps of the filters as they run, with everything around the nodes.
RUN_TURNS, RUN_STEPS = 3, 20


@dataclass(frozen=True, slots=True)
class Measured:
    """Times of a step on this machine, NumPy on one thread.

    Attributes
    ----------
    times : NodeTimes
    products : int
        Multiplications of the one node.
    predicted_together, predicted_busiest : float, s
        By the products of several nodes, if each takes as long as one of the one node.
    communication : float, s
        What the link adds.
    as_run : pair of StepTime
        The global filter (Joseph's form) and the decentralised one as they run: timeline, gates and dispositions with them.
    apart : float
        By how many sigmas their estimates differ at most, along the whole run.
    """

    times: NodeTimes
    products: int
    predicted_together: float
    predicted_busiest: float
    communication: float
    as_run: tuple[StepTime, StepTime]
    apart: float

    @property
    def product(self) -> float:
        """Seconds that a multiplication of the one node takes, with what goes with it."""
        return self.times.one / self.products

    @property
    def speed_up(self) -> float:
        """Of a processor for each node, with communication, by measured times of the nodes."""
        return self.times.one / (self.times.busiest + self.communication)


def measure(problem: Problem, cut: CutCost, progress: Progress | None = None) -> Measured:
    """Run both filters over the record, and time nodes over steps of it.

    Raises
    ------
    DataError
        No step fuses all rows.
    ConfigError
        A bank, or a filter with stages.
    """
    refuse_bank(problem, "a measurement of times", "time one member: estimator: {kind: kalman}, and its start")
    refuse_stages(problem, "a measurement of times", "time the filter without stages")
    seen: list[KeptSteps] = []

    def watch(prepared: Prepared) -> list[KeptSteps]:
        seen.append(KeptSteps(len(prepared.plan.states)))
        return list(seen)

    one, several = both_forms(problem, cut.nodes)
    nodes = run_problem(several, progress, watch=watch)
    whole = run_problem(one, progress, record=nodes.prepared.record)
    kept, rows = seen[0], sum(m.rows for m in several.plan.measurements)
    steps = [s for s in kept.steps if len(s.rows) == rows]
    if not steps:
        raise DataError(
            "no step of the record fuses every row of the measurements: nothing to time",
            hint="give the measurements common instants, such as one rate",
        )
    own = nodes_of(several)  # its rows come in the order of the nodes
    assert own is not None
    times = node_times(steps, own.groups, own.rows, (kept.prior_mean, kept.prior), TURNS)
    products = decentralised_cost(CutSizes.local((cut.sizes.states,), (rows,)))
    first, second = step_times([whole.prepared, nodes.prepared], RUN_TURNS, RUN_STEPS)
    scale = np.where(whole.sigma > 0.0, whole.sigma, 1.0)
    return Measured(
        times=times,
        products=products,
        predicted_together=times.one / products * cut.products("decentralised"),
        predicted_busiest=times.one / products * cut.products("busiest"),
        communication=cut.times.words + cut.times.waiting,
        as_run=(first, second),
        apart=float(np.max(np.abs(whole.estimate - nodes.estimate) / scale, initial=0.0)),
    )
