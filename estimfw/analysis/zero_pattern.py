"""What is known of the entries of Phi and H before there are numbers: nothing there, +-1, anything else."""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import NDArray

from estimfw.plan.discretisation import Discretisation
from estimfw.plan.lowering import Lowered
from estimfw.plan.plan import Plan

__all__ = [
    "OTHER", "UNIT", "ZERO", "Pattern", "constants_of", "design_pattern", "pattern_of", "phi_pattern", "product",
    "read_states", "settled", "transition_pattern",
]  # fmt: skip

Pattern = NDArray[np.int8]
BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

#: Kinds of an entry.
ZERO, UNIT, OTHER = 0, 1, 2


def constants_of(plan: Plan, row: FloatArray) -> FloatArray:
    """The numbers (size,) of a complete nominal row that never change; NaN for those that do."""
    known = np.full(plan.layout.size, np.nan)
    for name in plan.layout.unpack(row):
        if plan.layout.changes(name) == "constant":
            known[plan.layout.places(name)] = row[plan.layout.places(name)]
    return known


def phi_pattern(plan: Plan, known: FloatArray) -> Pattern:
    """Of Phi (n, n), with what `constants_of` knows."""
    return transition_pattern(pattern_of(settled(plan.F, known)) != ZERO, plan.discretisation)


def design_pattern(plan: Plan, known: FloatArray) -> Pattern:
    """Of H (all rows of all measurements one behind the other, n)."""
    none = np.zeros((0, len(plan.states)), dtype=np.int8)
    return np.concatenate([none, *(pattern_of(settled(m.H, known)) for m in plan.measurements)])


def read_states(H: Pattern) -> tuple[tuple[int, ...], ...]:
    """The states that each row reads."""
    return tuple(tuple(int(i) for i in np.flatnonzero(h != ZERO)) for h in H)


def settled(matrix: Lowered, known: FloatArray) -> Lowered:
    """With numbers for the factors that are known (size,), NaN elsewhere: what is left are sums of what varies, and a number.

    Numbers of one entry are added up; what comes to zero is gone.
    """
    numbers: dict[int, float] = {}
    rest: list[tuple[int, float, tuple[int, ...]]] = []
    for entry, constant, factors in matrix.monomials:
        value = constant * float(np.prod([known[f] for f in factors if np.isfinite(known[f])]))
        left = tuple(f for f in factors if not np.isfinite(known[f]))
        if not left:
            numbers[entry] = numbers.get(entry, 0.0) + value
        elif value != 0.0:
            rest.append((entry, value, left))
    return Lowered(matrix.shape, (*((e, v, ()) for e, v in numbers.items() if v != 0.0), *rest))


def pattern_of(matrix: Lowered) -> Pattern:
    """ZERO, UNIT or OTHER for each entry (rows, columns) of a `settled` coefficient."""
    kinds = np.zeros(matrix.shape, dtype=np.int8)
    for entry, constant, factors in matrix.monomials:
        alone = kinds.flat[entry] == ZERO and not factors and abs(constant) == 1.0
        kinds.flat[entry] = UNIT if alone else OTHER
    return kinds


def transition_pattern(F: BoolArray, discretisation: Discretisation) -> Pattern:
    """Of Phi (n, n) for the non-zeros of F (n, n): what the powers of F reach that the discretisation takes.

    A diagonal entry that no power of F reaches is exactly 1.
    """
    n = F.shape[0]
    order = discretisation.phi_order if discretisation.method == "series" else n
    powers = [F]
    for _ in range(1, order):
        powers.append(product(powers[-1], F))
    reached = reduce(np.logical_or, powers[: max(order, 0)], np.zeros_like(F))
    return np.where(reached, OTHER, np.where(np.eye(n, dtype=bool), UNIT, ZERO)).astype(np.int8)


def product(a: BoolArray, b: BoolArray) -> BoolArray:
    """Where a product of matrices with these non-zeros has some."""
    return np.asarray((a.astype(np.int64) @ b.astype(np.int64)) > 0)
