"""How Phi and Q come from F and D: a setting of the plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import NumericalError
from estimfw.kernels.discretise import held_noise, series, van_loan
from estimfw.model.nominal import Evaluation

__all__ = ["Discretisation", "Method"]

FloatArray = NDArray[np.float64]

Method = Literal["van_loan", "held_noise", "series"]

#: Largest |eigenvalue of F| * dt of one sub-step.
STIFF = 1.0
#: More doublings than this would not end in a sensible time, nor in sensible numbers.
MOST_DOUBLINGS = 20


@dataclass(frozen=True, slots=True)
class Discretisation:
    """Exact for white noise (Van Loan) or for noise that is held over a step, or series of chosen orders; and where in the
    interval process terms are evaluated.

    Attributes
    ----------
    method : 'van_loan', 'held_noise' or 'series'
    phi_order, q_order : int
        Of the series: Phi to dt**phi_order, Q to dt**q_order (1: Q = D dt).
    evaluation : 'start', 'middle' or 'end'
    """

    method: Method = "van_loan"
    phi_order: int = 2
    q_order: int = 1
    evaluation: Evaluation = "middle"

    def doublings(self, F: FloatArray, dt: float) -> int:
        """How often the interval is halved so that no mode turns or decays by more than `STIFF` in a sub-step.

        Raises
        ------
        NumericalError
            F is not finite, or so stiff that sub-steps do not help.
        """
        if not np.all(np.isfinite(F)):
            raise NumericalError("the dynamics F are not finite")
        fastest = float(np.max(np.abs(np.linalg.eigvals(F)), initial=0.0)) * dt
        times = max(0, int(np.ceil(np.log2(fastest / STIFF)))) if fastest > STIFF else 0
        if times > MOST_DOUBLINGS:
            raise NumericalError(
                f"the dynamics are too stiff for the step: |eigenvalue of F| x dt = {fastest:.3g} (dt = {dt:g} s)",
                hint=f"at most {STIFF * 2**MOST_DOUBLINGS:.3g} can be sub-stepped; shorten the step, or drop the fast states",
            )
        return times

    def apply(
        self, F: FloatArray, D: FloatArray, b: FloatArray, dt: FloatArray, doublings: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Phi, Q (..., n, n) and d (..., n); see `estimfw.kernels.discretise`."""
        if self.method == "van_loan":
            return van_loan(F, D, b, dt, doublings)
        if self.method == "held_noise":
            return held_noise(F, D, b, dt, doublings)
        return series(F, D, b, dt, self.phi_order, self.q_order, doublings)

    def describe(self) -> str:
        """For people."""
        where = f"process terms at the {self.evaluation} of the interval"
        if self.method == "van_loan":
            return f"Van Loan, {where}"
        if self.method == "held_noise":
            return f"exact for noise held over each step, {where}"
        return f"series, Phi to order {self.phi_order} and Q to order {self.q_order}, {where}"
