"""What the states of an exact quotient stand for: combinations of the states of the model that it was made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from estimfw.model.model import Model

__all__ = ["Quotient"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Quotient:
    """x_r = T x with ``T F = F_r T`` and ``H = H_r T``.

    Attributes
    ----------
    of : Model
        The model with the states x.
    rows : tuple of tuple of float
        T (states, states of ``of``), SI.
    meanings : tuple of str
        What each state is: ``attitude_error[E] + 0.102 s2/m * accel_bias[N]``; its label where nothing changed.
    """

    of: Model
    rows: tuple[tuple[float, ...], ...]
    meanings: tuple[str, ...]

    @property
    def T(self) -> FloatArray:
        """(states, states of ``of``)."""
        return np.array(self.rows)

    def combined(self, values: FloatArray) -> FloatArray:
        """T @ values (..., n); what is unknown (NaN) makes only those unknown that it is part of."""
        T, known = self.T, np.isfinite(values)
        made = np.where(known, values, 0.0) @ T.T
        return np.where((~known).astype(float) @ np.abs(T).T > 0.0, np.nan, made)
