"""Known inputs over time: what a plan's schedules say at given instants."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME
from estimfw.plan.plan import Plan

__all__ = ["inputs_at"]

FloatArray = NDArray[np.float64]


def inputs_at(plan: Plan, time: FloatArray) -> FloatArray:
    """Known inputs (K, inputs) that hold from these instants (K,) on."""
    columns = []
    for known in plan.inputs:
        index = np.searchsorted(np.array(known.times), time + SAME, side="right") - 1
        values = np.array(known.values)[np.maximum(index, 0)]
        columns.append(np.where(index[:, None] >= 0, values, 0.0))
    return np.concatenate(columns, axis=1) if columns else np.zeros((time.size, 0))
