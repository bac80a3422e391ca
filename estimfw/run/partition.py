"""The states of a filter cut into groups, from a run of it; and what the cut costs a filter that neglects what it cuts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from estimfw.analysis.coupling import coupling
from estimfw.analysis.dense_cost import balanced_sizes
from estimfw.analysis.partition import Cut, best_cut, correlation, seeds_of
from estimfw.analysis.suboptimal import LinearStep, priced
from estimfw.analysis.zero_pattern import constants_of, design_pattern, read_states
from estimfw.config.compose import Problem
from estimfw.errors import ConfigError, UsageError
from estimfw.plan.separation import Form
from estimfw.run.kept_steps import KeptSteps
from estimfw.run.needs_states import refuse_bank, refuse_stages, refuse_without_states
from estimfw.run.node_owners import OwnedNode, owned_nodes
from estimfw.run.prepare import Prepared
from estimfw.run.run import Collected, Progress, run_problem

__all__ = ["PartitionBy", "Partitioned", "Price", "partition_filter"]

FloatArray = NDArray[np.float64]
Groups = tuple[tuple[int, ...], ...]

#: A part of the run at its end over which correlations should not change any more, and by how much they may.
LAST = 0.1
SETTLED = 0.05

FORMS: tuple[Form, ...] = ("drop", "decoupled")


@dataclass(frozen=True, slots=True)
class Price:
    """What a suboptimal form costs: ``ratio`` (n,) of true to optimal sigma of each state, at the end of the run."""

    form: Form
    ratio: FloatArray

    @property
    def worst(self) -> int:
        """The state that suffers most."""
        return int(np.argmax(self.ratio))


@dataclass(frozen=True)
class PartitionBy:
    """The best cut by one measure.

    Attributes
    ----------
    measure : str
        ``correlation`` or ``coupling``.
    weights : (n, n) array
        What the cut keeps together.
    cut : Cut
    nodes : tuple of OwnedNode
        As a config names them.
    prices : tuple of Price
        None where nothing was priced.
    """

    measure: str
    weights: FloatArray
    cut: Cut
    nodes: tuple[OwnedNode, ...]
    prices: tuple[Price, ...]


@dataclass(frozen=True)
class Partitioned:
    """What ``estimfw partition`` tells.

    Attributes
    ----------
    name : str
    states : tuple of str
    sizes : tuple of int
    seeds : tuple of tuple of int
        States that stay together, because a row reads them.
    time : float, s
        When the covariance was taken: the end of the run.
    since : float, s
    change : float
        By which the correlations changed most since ``since``; NaN where the run is too short to tell.
    changed : tuple of int
        The pair of states that did.
    correlation : (n, n) array
    fixed : tuple of int
        States without variance at the end.
    by_correlation, by_coupling : PartitionBy
    unpriced : str
        Why there are no prices; empty where there are.
    """

    name: str
    states: tuple[str, ...]
    sizes: tuple[int, ...]
    seeds: Groups
    time: float
    since: float
    change: float
    changed: tuple[int, int]
    correlation: FloatArray
    fixed: tuple[int, ...]
    by_correlation: PartitionBy
    by_coupling: PartitionBy
    unpriced: str

    @property
    def settled(self) -> bool:
        """The correlations do not change any more."""
        return self.change <= SETTLED


def partition_filter(
    problem: Problem, into: int, sizes: Sequence[int] = (), *, price: bool = True, progress: Progress | None = None
) -> Partitioned:
    """Run the global filter and cut its states into groups.

    Parameters
    ----------
    problem : Problem
    into : int
        How many groups.
    sizes : sequence of int
        Of the groups; left out: balanced.
    price : bool
        Tell what the groups cost filters that neglect the covariance between them.
    progress : callable, optional
        See `run_problem`.

    Raises
    ------
    EstimfwError
        Of any kind; ConfigError where the filter cannot be cut so.
    """
    wanted = _sizes(problem, into, sizes)
    plan = problem.plan
    H = design_pattern(plan, constants_of(plan, plan.layout.complete(plan.layout.pack(problem.reference))))
    reads = read_states(H)
    seeds = seeds_of(reads)
    _refuse_uncuttable(problem, reads, seeds, wanted)
    seen: list[KeptSteps] = []

    def watch(prepared: Prepared) -> list[KeptSteps]:
        seen.append(KeptSteps(len(prepared.plan.states)))
        return list(seen)

    done = run_problem(problem, progress, watch=watch)
    P, kept, labels = done.covariance[-1], seen[0], [label for m in plan.measurements for label in m.labels]
    rho = correlation(P)
    since, change, changed = _change(done, rho)
    unpriced = kept.lost if price else "--no-price"
    price_of = _Pricing(kept, progress)

    def by(measure: str, weights: FloatArray) -> PartitionBy:
        cut = best_cut(weights, wanted, seeds)
        owners = [next((g for g, own in enumerate(cut.groups) if set(read) & set(own)), 0) for read in reads]
        prices = () if unpriced else price_of(cut.groups, owners)
        return PartitionBy(measure, weights, cut, owned_nodes(problem.model, labels, cut.groups, owners), prices)

    sigma = np.sqrt(np.maximum(np.diag(P), 0.0))
    return Partitioned(
        name=str(problem.config.name),
        states=plan.states,
        sizes=wanted,
        seeds=seeds,
        time=float(done.prepared.steps.time[-1]),
        since=since,
        change=change,
        changed=changed,
        correlation=rho,
        fixed=tuple(int(i) for i in np.flatnonzero(sigma <= 0.0)),
        by_correlation=by("correlation", np.abs(rho)),
        by_coupling=by("coupling", coupling(kept.mean_transition, sigma)),
        unpriced=unpriced,
    )


class _Pricing:
    """Prices of groups, each once, however many measures find them."""

    def __init__(self, kept: KeptSteps, progress: Progress | None) -> None:
        self.kept, self.progress = kept, progress
        self.known: dict[Groups, tuple[Price, ...]] = {}

    def __call__(self, groups: Groups, owners: Sequence[int]) -> tuple[Price, ...]:
        if groups not in self.known:
            self.known[groups] = tuple(self._price(form, groups, owners) for form in FORMS)
        return self.known[groups]

    def _price(self, form: Form, groups: Groups, owners: Sequence[int]) -> Price:
        kept = self.kept
        with threadpool_limits(1, user_api="blas"):  # matrices are small: threads only wait for each other
            found = priced(form, groups, self._steps(), kept.prior_mean, kept.prior, owners)
        return Price(form, found.ratio[-1])

    def _steps(self) -> Iterator[LinearStep]:
        """The steps, with a sign of life at each."""
        for k, step in enumerate(self.kept.steps, start=1):
            yield step
            if self.progress is not None:
                self.progress(k, len(self.kept.steps))


def _sizes(problem: Problem, into: int, sizes: Sequence[int]) -> tuple[int, ...]:
    refuse_without_states(problem, "a partition")
    refuse_bank(problem, "a partition", "cut the member that wins: estimator: {kind: kalman}, and its start")
    refuse_stages(problem, "a partition", "cut the filter without stages")
    if problem.kind == "unscented":
        raise ConfigError(
            "an unscented filter cannot be cut: successive orthogonalisation is for linear measurements",
            location=problem.document.locate(("estimator", "kind")),
            hint="cut the filter with estimator: {kind: kalman}",
        )
    if problem.plan.separation is not None:
        raise ConfigError(
            f"the covariance of the form {problem.plan.separation.form!r} is not what the measurements leave",
            location=problem.document.locate(("estimator", "cross_covariance")),
            hint="cut the exact filter: --set estimator.cross_covariance=exact",
        )
    n = len(problem.plan.states)
    if into < 2:
        raise UsageError(f"into {into} groups: one group is the filter itself", hint="--into 2, or more")
    if into > n:
        raise UsageError(f"{n} states cannot be cut into {into} groups", hint=f"--into {n} is the most")
    if sizes and (len(sizes) != into or sum(sizes) != n or min(sizes) < 1):
        told = ", ".join(map(str, sizes))
        raise UsageError(
            f"--sizes {told}: {into} sizes that add up to {n} states are due",
            hint=f"such as --sizes {','.join(map(str, balanced_sizes(n, into)))}",
        )
    return tuple(sorted(sizes, reverse=True)) or balanced_sizes(n, into)


def _refuse_uncuttable(problem: Problem, reads: Groups, seeds: Groups, sizes: tuple[int, ...]) -> None:
    plan = problem.plan
    if not plan.measurements:
        raise ConfigError(
            "there is no measurement: nodes would have nothing to tell each other",
            location=problem.document.locate(()),
            hint="write measurements, or simulate without a filter",
        )
    largest = max(seeds, key=len, default=())
    if len(largest) <= sizes[0]:
        return
    labels = [label for m in plan.measurements for label in m.labels]
    rows = [label for label, read in zip(labels, reads, strict=True) if set(read) & set(largest)]
    why = f"the row {rows[0]} reads" if len(rows) == 1 else f"the rows {', '.join(rows)} share states, and read"
    states = ", ".join(plan.states[i] for i in largest)
    whole = "all states" if len(largest) == len(plan.states) else f"{len(largest)} states ({states})"
    fits = len(plan.states) - len(largest)
    raise ConfigError(
        f"it cannot be cut into groups of {', '.join(map(str, sizes))}: {why} {whole}, which stay together",
        location=problem.document.locate(("measurements",)),
        hint=f"such as --sizes {len(largest)},{fits}" if fits else "a node has to own what its measurement reads",
    )


def _change(done: Collected, rho: FloatArray) -> tuple[float, float, tuple[int, int]]:
    """Since when, and by how much and of which pair, the correlations changed most before the end."""
    at = done.covariance_index
    early = int(np.argmin(np.abs(at - (1.0 - LAST) * at[-1])))
    moved = np.abs(rho - correlation(done.covariance[early]))
    if early == len(at) - 1:
        return float(done.prepared.steps.time[-1]), float("nan"), (0, 0)
    i, j = np.unravel_index(int(np.argmax(moved)), moved.shape)
    return float(done.prepared.steps.time[at[early]]), float(moved[i, j]), (int(min(i, j)), int(max(i, j)))
