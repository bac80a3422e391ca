"""What a step of a config's filter costs in each form, and what a processor for each of its subsystems would gain."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from estimfw.analysis.block_cost import cut_of, decentralised_pattern_cost, selecting_rows
from estimfw.analysis.cost import joseph_cost, predict_cost, ud_cost, update_cost
from estimfw.analysis.counted_forms import counted_decentralised, counted_global
from estimfw.analysis.dense_cost import (
    CutSizes,
    busiest_processor_cost,
    decentralised_cost,
    joseph_at_once_cost,
    symmetric_cost,
    textbook_cost,
    words_sent,
)
from estimfw.analysis.speed_up import Link, SpeedUp, break_even_latency, break_even_states, largest_speed_up, speed_up
from estimfw.analysis.zero_pattern import OTHER, UNIT, ZERO, Pattern, constants_of, design_pattern, phi_pattern
from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.run.needs_states import refuse_without_states
from estimfw.run.partition import Partitioned

__all__ = ["Costed", "CutCost", "FormCost", "Nodes", "cost_of_filter", "nodes_by_groups", "nodes_of"]

Groups = tuple[tuple[int, ...], ...]

#: More states than this are counted only where that is asked for: a step at 40 states takes about a second.
COUNTED = 40


@dataclass(frozen=True, slots=True)
class FormCost:
    """Multiplications of a step in one form.

    ``key`` names the form; ``counted`` is what a run on counting numbers took, None where it was not run.
    """

    key: str
    products: int
    counted: int | None = None


@dataclass(frozen=True, slots=True)
class Nodes:
    """Who owns what: states, and rows of all measurements of the plan one behind the other, by node."""

    names: tuple[str, ...]
    groups: Groups
    rows: Groups


@dataclass(frozen=True)
class CutCost:
    """What the filter costs cut into nodes.

    Attributes
    ----------
    nodes : Nodes
    sizes : CutSizes
    forms : tuple of FormCost
    words, stages : int
        By formula.
    counted_words, counted_rounds : int or None
        As the nodes exchange them.
    link : Link
    times : SpeedUp
    break_even_latency : float, s
    break_even_states : int or None
        For equal nodes with as many rows a state.
    largest : float
        What that gains for very many states without communication.
    """

    nodes: Nodes
    sizes: CutSizes
    forms: tuple[FormCost, ...]
    words: int
    counted_words: int | None
    counted_rounds: int | None
    link: Link
    times: SpeedUp
    break_even_latency: float
    break_even_states: int | None
    largest: float

    def products(self, key: str) -> int:
        return next(f.products for f in self.forms if f.key == key)


@dataclass(frozen=True)
class Costed:
    """What ``estimfw cost`` tells.

    Attributes
    ----------
    name : str
    states, rows : int
    kernel : str
        ``ud`` or ``joseph``: the dense kernel that the config names; ``full`` of a decentralised filter.
    varying : str
        Why Phi and Q are made anew at each step, which is not counted here; empty where they are not.
    selecting : bool
        Whether each row reads one state as it is.
    correlated : bool
        Whether rows of one measurement have correlated noises, which have to be told apart first.
    members : bool
        Whether it is that of one member of a bank.
    forms : tuple of FormCost
        Of one processor.
    cut : CutCost or None
        None where the filter has no nodes.
    """

    name: str
    states: int
    rows: int
    kernel: str
    varying: str
    selecting: bool
    correlated: bool
    members: bool
    forms: tuple[FormCost, ...]
    cut: CutCost | None

    def products(self, key: str) -> int:
        return next(f.products for f in self.forms if f.key == key)


def cost_of_filter(problem: Problem, link: Link, nodes: Nodes | None = None, *, counted: bool | None = None) -> Costed:
    """Count.

    Parameters
    ----------
    problem : Problem
    link : Link
        Between the processors of nodes.
    nodes : Nodes, optional
        Left out: those of a decentralised filter.
    counted : bool, optional
        Run each form on numbers that count; left out: where there are not too many states.

    Raises
    ------
    ConfigError
        A determination or an unscented filter; no measurement.
    """
    refuse_without_states(problem, "a cost")
    _refuse_others(problem)
    plan = problem.plan
    known = constants_of(plan, plan.layout.complete(plan.layout.pack(problem.reference)))
    Phi, H = phi_pattern(plan, known), design_pattern(plan, known)
    run = len(Phi) <= COUNTED if counted is None else counted
    nodes = nodes or nodes_of(problem)
    return Costed(
        name=str(problem.config.name),
        states=len(Phi),
        rows=len(H),
        kernel=problem.estimator.covariance,
        varying=plan.reason if plan.pace == "varying" else "",
        selecting=_selecting(H),
        correlated=any(R != 0.0 for m in plan.whole.measurements for i, row in enumerate(m.R) for R in row[:i]),
        members=problem.kind == "bank",
        forms=_global_forms(Phi, H, problem.estimator.covariance, run=run),
        cut=_cut_cost(Phi, H, nodes, link, run=run) if nodes is not None else None,
    )


def nodes_of(problem: Problem) -> Nodes | None:
    """The nodes of a decentralised filter; None of another one."""
    subsystems = problem.plan.subsystems
    if subsystems is None:
        return None
    ends = np.cumsum([0, *(m.rows for m in problem.plan.measurements)]).tolist()
    rows = tuple(tuple(i for j in n.measurements for i in range(ends[j], ends[j + 1])) for n in subsystems.nodes)
    return Nodes(tuple(n.name for n in subsystems.nodes), tuple(n.states for n in subsystems.nodes), rows)


def nodes_by_groups(problem: Problem, found: Partitioned) -> Nodes:
    """The nodes that a partition by correlation makes."""
    labels = [label for m in problem.plan.measurements for label in m.labels]
    owned = found.by_correlation.nodes
    rows = tuple(tuple(labels.index(label) for label in node.rows) for node in owned)
    return Nodes(tuple(n.name for n in owned), found.by_correlation.cut.groups, rows)


def _refuse_others(problem: Problem) -> None:
    if problem.kind == "unscented":
        raise ConfigError(
            "an unscented filter has no products to count: its work is that of the model at each sigma point",
            location=problem.document.locate(("estimator", "kind")),
            hint="count estimator: {kind: kalman}",
        )
    if not problem.plan.measurements:
        raise ConfigError(
            "there is no measurement, so no step to count",
            location=problem.document.locate(()),
            hint="write measurements",
        )


def _selecting(H: Pattern) -> bool:
    """Each row reads one state, as it is."""
    return bool(np.all(np.count_nonzero(H != ZERO, axis=1) == 1) and not np.any(H > UNIT))


def _global_forms(Phi: Pattern, H: Pattern, kernel: str, *, run: bool) -> tuple[FormCost, ...]:
    n, m = len(Phi), len(H)
    as_run = {"ud": ud_cost, "joseph": joseph_cost}
    formulas = {
        "textbook": textbook_cost(n, m),
        "joseph_at_once": joseph_at_once_cost(n, m),
        "symmetric": symmetric_cost(n, m),
        "selecting": symmetric_cost(n, m, selecting=True),
        "pattern": predict_cost(Phi) + sum(update_cost(h) for h in H),
    }
    found = counted_global(Phi, H) if run else {}
    forms = [FormCost(key, products, found.get(key)) for key, products in formulas.items()]
    return (*forms, *(FormCost(key, cost(n, m)) for key, cost in as_run.items() if key == kernel))


def _cut_cost(Phi: Pattern, H: Pattern, nodes: Nodes, link: Link, *, run: bool) -> CutCost:
    sizes = cut_of(H, nodes.groups, nodes.rows)
    pattern, owned = (Phi, H, nodes.groups, nodes.rows), (nodes.groups, nodes.rows)
    full, one_each = np.full_like(Phi, OTHER), selecting_rows(len(Phi), *owned)
    formulas = {
        "decentralised": decentralised_cost(sizes),
        "triangular": decentralised_cost(sizes, triangular=True),
        "decentralised_selecting": decentralised_pattern_cost(full, one_each, *owned, triangular=True),
        "decentralised_pattern": decentralised_pattern_cost(*pattern, triangular=True),
        "busiest": busiest_processor_cost(sizes),
    }
    found = counted_decentralised(*pattern) if run else None
    products = found.products if found is not None else {}
    share = Fraction(sizes.measured, sizes.states)
    return CutCost(
        nodes=nodes,
        sizes=sizes,
        forms=tuple(FormCost(key, value, products.get(key)) for key, value in formulas.items()),
        words=words_sent(sizes),
        counted_words=found.words if found is not None else None,
        counted_rounds=found.rounds if found is not None else None,
        link=link,
        times=speed_up(sizes, link),
        break_even_latency=break_even_latency(sizes, link),
        break_even_states=break_even_states(len(nodes.groups), share, link),
        largest=largest_speed_up(len(nodes.groups), float(share)),
    )
