"""Directions that the measurements cannot see, written in state names and units."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.observability import FrozenObservability, frozen_observability, least_determined_removable
from estimfw.model.model import Model
from estimfw.units.unit_text import parse_unit

__all__ = ["directions_in_names", "undetectable_directions"]

FloatArray = NDArray[np.float64]

#: A mode decaying faster than this (1/s) forgets by itself.
DECAY = 1e-12
#: A change of a state smaller than this of all that stays undetermined of it is not printed.
SMALL = 0.05
#: Of a prior sigma: what is smaller is rounding.
NOTHING = 1e-9


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
    units = [(b.unit, b.display_unit or b.unit) for b in model.blocks for _ in b.axes]
    return directions_in_names(found, covariance, list(model.states), units)


def directions_in_names(
    found: FrozenObservability, covariance: FloatArray, states: list[str], units: list[tuple[str, str]]
) -> list[str]:
    """One text a direction, such as ``accel_bias[N] 100 ug, attitude_error[E] -0.00573 deg``: a change that is not seen.

    The directions are combined so that each holds one of the least determined states, changed by one prior sigma, and none of
    the others'. ``units`` are the SI and the display unit of each state.
    """
    chosen = least_determined_removable(found, covariance, [False] * len(states))
    if chosen is None:
        return []
    kernel = found.kernel @ np.linalg.inv(found.kernel[chosen])
    sigma = np.sqrt(np.diag(covariance))
    sigma = np.where(sigma > 0.0, sigma, 1.0)
    # Not against the prior sigma: 0.006 deg of 10 deg is all that stays open of a tilt, and what a user asks for.
    rest = np.linalg.norm(found.kernel, axis=1)
    texts = []
    for column, own in enumerate(chosen):
        change = kernel[:, column] * sigma[own]
        order = np.argsort(-np.abs(change / sigma), kind="stable")
        others = [i for i in order if i != own and abs(change[i]) > max(SMALL * rest[i], NOTHING * sigma[i])]
        texts.append(", ".join(f"{states[i]} {_shown(change[i], *units[i])}" for i in (own, *others)))
    return texts


def _shown(value: float, unit: str, display: str) -> str:
    """A number in the unit in which people read it: ``-0.00573 deg``."""
    scale = float(parse_unit(unit).scale) / float(parse_unit(display).scale)
    return f"{value * scale:.3g} {display if display != '1' else ''}".strip()
