"""Directions that the measurements cannot see, written in state names and units."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.observability import FrozenObservability, frozen_observability, least_determined_removable
from estimfw.model.model import Model

__all__ = ["directions_in_names", "undetectable_directions"]

FloatArray = NDArray[np.float64]

#: A mode decaying faster than this (1/s) forgets by itself.
DECAY = 1e-12
#: A part smaller than this of the largest, in prior sigmas, is not printed.
SMALL = 1e-6


def undetectable_directions(model: Model, nominal: Mapping[str, FloatArray]) -> list[str]:
    """The unobservable directions that do not decay by themselves, in state names, at a frozen nominal."""
    if not model.measurements:
        return []
    F = model.F.coefficient.evaluate(nominal)
    H = np.vstack([model.H(m.name).coefficient.evaluate(nominal) for m in model.measurements])
    covariance = model.prior.evaluate(nominal)[1]
    found = frozen_observability(F, H, covariance)
    if not found.kernel.shape[1]:
        return []
    inside = np.linalg.pinv(found.kernel) @ F @ found.kernel
    if np.all(np.linalg.eigvals(inside).real < -DECAY):
        return []
    units = [b.unit for b in model.blocks for _ in b.axes]
    return directions_in_names(found, covariance, list(model.states), units)


def directions_in_names(
    found: FrozenObservability, covariance: FloatArray, states: list[str], units: list[str]
) -> list[str]:
    """One text a direction, such as ``accel_bias[N] - 0.1021 s^2/m * attitude_error[E]``.

    The directions are combined so that each holds one of the least determined states with factor 1, and none of the others'.
    """
    chosen = least_determined_removable(found, covariance, [False] * len(states))
    if chosen is None:
        return []
    kernel = found.kernel @ np.linalg.inv(found.kernel[chosen])
    sigma = np.sqrt(np.diag(covariance))
    sigma = np.where(sigma > 0.0, sigma, 1.0)
    texts = []
    for column, own in enumerate(chosen):
        direction = kernel[:, column]
        weight = np.abs(direction / sigma)
        parts = [states[own]]
        for i in np.argsort(-weight, kind="stable"):
            if i == own or weight[i] <= SMALL * weight.max():
                continue
            sign = "-" if direction[i] < 0.0 else "+"
            unit = f" {units[i]}/({units[own]})" if units[i] != units[own] else ""
            parts.append(f"{sign} {abs(direction[i]):.4g}{unit} {states[i]}")
        texts.append(" ".join(parts))
    return texts
