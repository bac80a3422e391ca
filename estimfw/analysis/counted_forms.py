"""Each form of the filter run once, on random numbers with the zeros of a plan, to count its products."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from estimfw.analysis.block_cost import selecting_rows
from estimfw.analysis.counted_nodes import CountedStep, counted_step
from estimfw.analysis.counted_number import Tally, counted
from estimfw.analysis.filter_forms import StepArrays, joseph_step, symmetric_step, textbook_step
from estimfw.analysis.zero_pattern import OTHER, UNIT, ZERO, Pattern

__all__ = ["CountedNodes", "counted_decentralised", "counted_global"]

Groups = Sequence[Sequence[int]]

SEED = 1


@dataclass(frozen=True, slots=True)
class CountedNodes:
    """Products by form; words and exchanges of a step."""

    products: Mapping[str, int]
    words: int
    rounds: int


def counted_global(Phi: Pattern, H: Pattern) -> dict[str, int]:
    """Products of the forms of one processor, by key: dense, and ``pattern`` without what is zero or one by structure."""
    full = _step(np.full_like(Phi, OTHER), np.full_like(H, OTHER))
    rows, n = H.shape
    one_each = np.full_like(H, ZERO)
    one_each[np.arange(rows), np.arange(rows) % n] = UNIT
    made = {}
    for key, run in (("textbook", textbook_step), ("joseph_at_once", joseph_step), ("symmetric", symmetric_step)):
        tally = Tally()
        run(_counting(full, tally))
        made[key] = tally.products
    tally = Tally()
    symmetric_step(_counting(_step(np.full_like(Phi, OTHER), one_each), tally, "H"))
    made["selecting"] = tally.products
    made["pattern"] = min(_symmetric_products(Phi, H), _symmetric_products(Phi[::-1, ::-1], H[:, ::-1]))
    return made


def _symmetric_products(Phi: Pattern, H: Pattern) -> int:
    """With the lower half of P; of states in the opposite order that is the upper one."""
    tally = Tally()
    symmetric_step(_counting(_step(Phi, H), tally, "Phi", "H"))
    return tally.products


def counted_decentralised(Phi: Pattern, H: Pattern, groups: Groups, rows: Groups) -> CountedNodes:
    """Products of the nodes by key, and what they exchange.

    ``busiest`` is that of the busiest node between two exchanges, added up; of an odd P_ij one node has more than half,
    so that it is not quite the closed form's.
    """

    full, dense = np.full_like(Phi, OTHER), np.where(_blocks(H, groups, rows), OTHER, ZERO).astype(np.int8)
    one_each = selecting_rows(len(Phi), groups, rows)

    def run(Phi: Pattern, H: Pattern, *known: str, triangular: bool = True) -> CountedStep:
        tally = Tally()
        arrays = _counting(_step(Phi, H), tally, *known)
        return counted_step(arrays, tally, groups, rows, H != ZERO, triangular=triangular)

    whole, own = run(full, dense, triangular=False), run(Phi, H, "Phi", "H")
    products = {
        "decentralised": whole.total,
        "triangular": run(full, dense).total,
        "decentralised_selecting": run(full, one_each, "H").total,
        "decentralised_pattern": own.total,
        "busiest": whole.longest,
    }
    return CountedNodes(products, own.words, own.rounds)


def _blocks(H: Pattern, groups: Groups, rows: Groups) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """The blocks of H in which a row reads anything, whole."""
    live, made = H != ZERO, np.zeros(H.shape, dtype=bool)
    for own in map(list, rows):
        for group in map(list, groups):
            made[np.ix_(own, group)] = bool(np.any(live[np.ix_(own, group)]))
    return made


def _step(Phi: Pattern, H: Pattern) -> StepArrays:
    """Random numbers where the entries are OTHER."""
    n, m, rng = len(Phi), len(H), np.random.default_rng(SEED)
    A = rng.normal(size=(n, n))
    return StepArrays(
        x=rng.normal(size=n),
        P=A @ A.T + np.eye(n),
        Phi=np.where(Phi == OTHER, rng.normal(size=(n, n)), Phi),
        Q=np.eye(n),
        z=rng.normal(size=m),
        H=np.where(H == OTHER, rng.normal(size=(m, n)), H),
        R=np.eye(m),
    )


def _counting(step: StepArrays, tally: Tally, *known: str) -> StepArrays:
    """Of numbers that count; zeros and ones of the arrays in ``known`` are there by structure."""
    return StepArrays(*(counted(getattr(step, name), tally, known=name in known) for name in StepArrays.__slots__))
