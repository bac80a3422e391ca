"""Measured times of a step beside the counted work: one node that owns all, and several."""

from __future__ import annotations

from dataclasses import dataclass

from estimfw.analysis.dense_cost import CutSizes, decentralised_cost
from estimfw.config.compose import Problem
from estimfw.errors import DataError
from estimfw.run.cost import CutCost
from estimfw.run.kept_steps import KeptSteps
from estimfw.run.node_time import NodeTimes, node_times
from estimfw.run.prepare import Prepared
from estimfw.run.run import Progress, run_problem
from estimfw.run.step_time import step_times

__all__ = ["TURNS", "Measured", "measure"]

#: Turns of the nodes, and of the filter as it runs, which takes longer.
TURNS, AS_RUN = 9, 3


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
    own : float, s
        The config's filter as it runs, provider and all.
    kernel : str
        Of that.
    """

    times: NodeTimes
    products: int
    predicted_together: float
    predicted_busiest: float
    communication: float
    own: float
    kernel: str

    @property
    def product(self) -> float:
        """Seconds that a multiplication of the one node takes, with what goes with it."""
        return self.times.one / self.products

    @property
    def speed_up(self) -> float:
        """Of a processor for each node, with communication, by measured times of the nodes."""
        return self.times.one / (self.times.busiest + self.communication)


def measure(problem: Problem, cut: CutCost, progress: Progress | None = None) -> Measured:
    """Run the filter over its record and time its nodes over steps of it.

    Raises
    ------
    DataError
        No step fuses all rows.
    """
    seen: list[KeptSteps] = []

    def watch(prepared: Prepared) -> list[KeptSteps]:
        seen.append(KeptSteps(len(prepared.plan.states)))
        return list(seen)

    done, rows = run_problem(problem, progress, watch=watch), sum(m.rows for m in problem.plan.measurements)
    whole = [s for s in seen[0].steps if len(s.rows) == rows]
    if not whole:
        raise DataError(
            "no step of the record fuses every row of the measurements: nothing to time",
            hint="give the measurements common instants, such as one rate",
        )
    times = node_times(whole, cut.nodes.groups, cut.nodes.rows, (seen[0].prior_mean, seen[0].prior), TURNS)
    products = decentralised_cost(CutSizes.local((cut.sizes.states,), (rows,)))
    own = step_times([done.prepared], AS_RUN)[0]
    each = times.one / products
    return Measured(
        times=times,
        products=products,
        predicted_together=each * cut.products("decentralised"),
        predicted_busiest=each * cut.products("busiest"),
        communication=cut.times.words + cut.times.waiting,
        own=own.seconds,
        kernel=own.kernel,
    )
