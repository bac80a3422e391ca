"""A model frozen at one nominal, as a linear system."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.observability import LinearStretch
from estimfw.model.model import Model

__all__ = ["frozen_stretch"]

FloatArray = NDArray[np.float64]


def frozen_stretch(model: Model, nominal: Mapping[str, FloatArray]) -> LinearStretch:
    """F and the rows of all measurements at a nominal."""
    values = model.nominal(nominal)
    rows = [model.H(m.name).coefficient.evaluate(values) for m in model.measurements]
    return LinearStretch(model.F.coefficient.evaluate(values), np.vstack([np.zeros((0, len(model.states))), *rows]))
