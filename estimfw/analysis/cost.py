"""What a step of a filter costs in multiplications: by the zero pattern of its matrices, and as the dense kernels do it.

A division counts as a multiplication; a product with a structural zero or with +-1 does not count. The form that is
counted by pattern keeps half of a symmetric covariance and takes measurements one component at a time; dense, that is
n^2 + n^3 + n^2 (n + 1) / 2 + m (n^2 + 4 n + n (n + 1) / 2), and straight-line code for the pattern needs no more. The
covariance itself is taken to be full, which it is after a few steps of almost any filter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.zero_pattern import (
    OTHER,
    ZERO,
    Pattern,
    constants_of,
    design_pattern,
    pattern_of,
    phi_pattern,
    product,
    settled,
)
from estimfw.plan.discretisation import Discretisation
from estimfw.plan.lowering import Lowered
from estimfw.plan.plan import Plan

__all__ = ["StepCost", "joseph_cost", "predict_cost", "rebuild_cost", "step_cost", "ud_cost", "update_cost"]

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StepCost:
    """Multiplications of one step in which every measurement is fused.

    Attributes
    ----------
    states : int
    nonzeros_F, nonzeros_Phi, nonzeros_H : int
        Entries that are not zero by structure.
    predict, update : int
        Of estimate and covariance, by pattern.
    rebuild : int
        For making F, D, Phi and Q anew, by pattern; 0 where they are made once.
    exponential : bool
        A matrix exponential of 2 n + 1 rows is needed at each step, too; it is not counted.
    as_run : int
        Predict and update of the dense kernel that the config names (UD or Joseph).
    """

    states: int
    nonzeros_F: int
    nonzeros_Phi: int
    nonzeros_H: int
    predict: int
    update: int
    rebuild: int
    exponential: bool
    as_run: int

    @property
    def total(self) -> int:
        """Predict, update and what has to be made anew, by pattern."""
        return self.predict + self.update + self.rebuild


def step_cost(plan: Plan, covariance: str, row: FloatArray) -> StepCost:
    """The cost of a step of a plan.

    Parameters
    ----------
    plan : Plan
    covariance : 'ud' or 'joseph'
        The dense kernel that runs.
    row : (size,) array
        A complete nominal row: what never changes is a number, and may be zero (the Earth's rate about East).
    """
    known = constants_of(plan, row)
    F, D = settled(plan.F, known), settled(plan.D, known)
    n, rows = len(plan.states), sum(m.rows for m in plan.measurements)
    Phi, H = phi_pattern(plan, known), design_pattern(plan, known)
    series = plan.discretisation.method == "series"
    varying = plan.pace == "varying"
    dense = ud_cost if covariance == "ud" else joseph_cost
    return StepCost(
        states=n,
        nonzeros_F=int(np.count_nonzero(pattern_of(F))),
        nonzeros_Phi=int(np.count_nonzero(Phi)),
        nonzeros_H=int(np.count_nonzero(H)),
        predict=predict_cost(Phi),
        update=sum(update_cost(h) for h in H),
        rebuild=rebuild_cost(F, D, plan.discretisation) if varying else 0,
        exponential=varying and not series,
        as_run=dense(n, rows),
    )


def predict_cost(Phi: Pattern) -> int:
    """x <- Phi x; Phi P; of (Phi P) Phi' + Q the half, upper or lower, that is cheaper."""
    n = Phi.shape[0]
    each = np.count_nonzero(Phi == OTHER, axis=1)
    upto = np.arange(n) + 1  # entries of column j of the product up to the diagonal
    half = min(int((each * upto).sum()), int((each * upto[::-1]).sum()))
    return int(each.sum() + n * each.sum() + half)


def update_cost(h: Pattern) -> int:
    """One component with the row h (n,): h x, P h, h P h' + r, the gain, x + K t, and half of P - K (P h)'."""
    n = len(h)
    each = int(np.count_nonzero(h == OTHER))
    return n * each + 2 * each + 2 * n + n * (n + 1) // 2


def rebuild_cost(F: Lowered, D: Lowered, discretisation: Discretisation) -> int:
    """The products of the coefficients, and for a series the powers of F and the terms of Q."""
    total = _evaluation(F) + _evaluation(D)
    if discretisation.method != "series":
        return total
    f, term = pattern_of(F) != ZERO, pattern_of(D) != ZERO
    power = np.eye(f.shape[0], dtype=bool)
    for k in range(1, discretisation.phi_order + 1):
        total += 0 if k == 1 else _pairs(power, f)
        power = product(power, f)
        total += int(np.count_nonzero(power))
    total += int(np.count_nonzero(term))
    for _ in range(2, discretisation.q_order + 1):
        total += _pairs(f, term)
        half = product(f, term)
        term = half | half.T
        total += int(np.count_nonzero(np.tril(term)))
    return total


def ud_cost(n: int, rows: int) -> int:
    """Thornton's prediction and Bierman's update of ``rows`` components with dense matrices: `estimfw.kernels.ud`."""
    predict = n * n + n**3 + 4 * n * n + (4 * n + 1) * (n * (n - 1) // 2)
    return predict + rows * (2 * n * n + 7 * n)


def joseph_cost(n: int, rows: int) -> int:
    """Phi P Phi' and Joseph's update of ``rows`` components with dense matrices: `estimfw.kernels.joseph`."""
    return n * n + 2 * n**3 + rows * (5 * n * n + 5 * n)


def _evaluation(matrix: Lowered) -> int:
    """A monomial of k factors takes k products, one less where its constant is +-1."""
    return sum(max(0, len(f) - (abs(constant) == 1.0)) for _, constant, f in matrix.monomials)


def _pairs(a: BoolArray, b: BoolArray) -> int:
    return int((a.astype(np.int64) @ b.astype(np.int64)).sum())
