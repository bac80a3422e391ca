"""Filters side by side that know nothing of how their errors belong together: the cheap forms of a decentralised filter.

States and rows belong to groups. Form ``drop`` predicts with all of Phi, but no covariance between groups is kept: P_ij = 0 for
i != j before and after each update, and a row corrects the states of its own group alone,

    P <- [Phi P Phi' + Q]_ii,   S_l = sum_j H_lj P_jj H_lj' + R_ll,   K_l = P_ll H_ll' S_l^-1,   K_il = 0 for i != l.

Form ``decoupled`` moreover leaves Phi_ij, Q_ij, H_ij away for i != j, so that each filter is alone. Neither is the optimal
filter, and neither knows its own sigma: `estimfw.analysis.suboptimal` finds what it really is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["Form", "Separation"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Form = Literal["drop", "decoupled"]


@dataclass(frozen=True, slots=True)
class Separation:
    """``states`` (n,) and ``rows`` (m,): the group of each state, and of each row of the measurements one behind the other."""

    form: Form
    states: tuple[int, ...]
    rows: tuple[int, ...]

    @property
    def within(self) -> BoolArray:
        """Which pairs of states (n, n) belong to one group."""
        of = np.array(self.states, dtype=np.int64)
        return np.asarray(of[:, None] == of)

    @property
    def corrects(self) -> BoolArray:
        """Which states (n, m) a row corrects."""
        return np.asarray(np.array(self.states, dtype=np.int64)[:, None] == np.array(self.rows, dtype=np.int64))

    @property
    def together(self) -> BoolArray:
        """Which pairs of rows (m, m) are fused by one filter."""
        of = np.array(self.rows, dtype=np.int64)
        return np.asarray(of[:, None] == of)

    def transition(self, Phi: FloatArray, Q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Phi and Q (..., n, n) as the filters have them."""
        if self.form == "drop":
            return Phi, Q
        return np.where(self.within, Phi, 0.0), np.where(self.within, Q, 0.0)

    def design(self, H: FloatArray) -> FloatArray:
        """H (..., m, n) as the filters have it."""
        return H if self.form == "drop" else np.where(self.corrects.T, H, 0.0)

    def covariance(self, P: FloatArray) -> FloatArray:
        """What is kept of a covariance (..., n, n)."""
        return np.where(self.within, P, 0.0)

    def gain(self, P: FloatArray, H: FloatArray, R: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gains (..., n, m) and innovation covariances (..., m, m) for a predicted P; H and R as they are."""
        P, H = self.covariance(P), self.design(H)
        PHt = P @ np.swapaxes(H, -1, -2)
        S = np.where(self.together, H @ PHt + R, 0.0)
        K = np.swapaxes(np.linalg.solve(S, np.swapaxes(np.where(self.corrects, PHt, 0.0), -1, -2)), -1, -2)
        return K, S
