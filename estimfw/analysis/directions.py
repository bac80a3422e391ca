"""Directions that the measurements cannot see, written in state names and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.frozen import frozen_stretch
from estimfw.analysis.observability import Observability, frozen_observability
from estimfw.analysis.removable import independent_states
from estimfw.model.model import Model
from estimfw.units.ratio import unit_ratio
from estimfw.units.unit_text import parse_unit

__all__ = ["Direction", "StateNames", "Term", "combination", "directions_of", "undetectable_directions", "unseen_rates"]

FloatArray = NDArray[np.float64]

#: A mode decaying faster than this (1/s) forgets by itself.
DECAY = 1e-12
#: A change of a state smaller than this of all that stays undetermined of it is not part of an example.
SMALL = 0.05
#: The same, for the text of a combination, which has three digits, and for its terms.
UNPRINTED, UNTOLD = 1e-3, 1e-7
#: Of a prior sigma: what is smaller is rounding.
NOTHING = 1e-9


@dataclass(frozen=True, slots=True)
class StateNames:
    """Labels of states, their SI units, and the units in which people read them."""

    states: tuple[str, ...]
    units: tuple[str, ...]
    display: tuple[str, ...]

    @classmethod
    def of(cls, model: Model) -> StateNames:
        each = [(b.unit, b.display_unit or b.unit) for b in model.blocks for _ in b.axes]
        return cls(model.states, tuple(u for u, _ in each), tuple(d for _, d in each))


@dataclass(frozen=True, slots=True)
class Term:
    """``coefficient`` times a state; ``unit`` (SI) is that of the state over that of the direction's first state."""

    state: str
    coefficient: float
    unit: str


@dataclass(frozen=True, slots=True)
class Direction:
    """A change of several states at once.

    Attributes
    ----------
    text : str
        ``attitude_error[U] - 6.05e-05 1/s * gyro_bias[E]``: so much of the others goes with one unit of the first.
    terms : tuple of Term
        The same, complete.
    example : str
        A change of one prior sigma, for people: ``gyro_bias[E] 0.01 deg/h, attitude_error[U] -0.0459 deg``.
    """

    text: str
    terms: tuple[Term, ...]
    example: str


def undetectable_directions(model: Model, nominal: Mapping[str, FloatArray]) -> list[str]:
    """Examples of the unobservable directions that do not decay by themselves, in state names, at a frozen nominal."""
    if not model.measurements:
        return []
    frozen, covariance = frozen_stretch(model, nominal), model.prior.evaluate(nominal)[1]
    found = frozen_observability(frozen.F, frozen.H, covariance)
    if np.all(unseen_rates(found, frozen.F) < -DECAY):
        return []
    names = StateNames.of(model)
    return [d.example for d in directions_of(found, covariance, names, np.zeros(len(names.states), dtype=bool))]


def unseen_rates(found: Observability, F: FloatArray) -> FloatArray:
    """Growth rates (1/s) of the modes in the unobservable directions: a negative one decays by itself; (n - rank,)."""
    inside = np.linalg.pinv(found.kernel) @ F @ found.kernel
    return np.sort(np.linalg.eigvals(inside).real)


def directions_of(
    found: Observability, covariance: FloatArray, names: StateNames, driven: Sequence[bool] | NDArray[np.bool_]
) -> list[Direction]:
    """The unobservable directions.

    They are combined so that each holds one of the least determined states and none of the others'. It is told by the
    state that takes up most of it among those that others drive: a tilt that goes with a bias, not the bias.

    Parameters
    ----------
    found : Observability
    covariance : (n, n) array
        The prior.
    names : StateNames
    driven : (n,) sequence of bool
        Which states others drive.
    """
    own = list(independent_states(found, covariance))
    if not own:
        return []
    sigma = np.sqrt(np.diag(covariance))
    sigma = np.where(sigma > 0.0, sigma, 1.0)
    # Not against the prior sigma: 0.006 deg of 10 deg is all that stays open of a tilt, and what a user asks for.
    open_part = np.linalg.norm(found.kernel, axis=1)
    changes = (found.kernel @ np.linalg.inv(found.kernel[own])).T * sigma[own][:, None]
    return [_direction(c, i, sigma, open_part, names, driven) for i, c in zip(own, changes, strict=True)]


def _direction(
    change: FloatArray, own: int, sigma: FloatArray, open_part: FloatArray, names: StateNames,
    driven: Sequence[bool] | NDArray[np.bool_],
) -> Direction:  # fmt: skip
    share = np.abs(change) / np.where(open_part > 0.0, open_part, 1.0)
    known = (np.abs(change) > NOTHING * sigma) & (share > UNTOLD)
    order = [int(i) for i in np.argsort(-np.abs(change / sigma), kind="stable")]
    told = [own, *(i for i in order if i != own and known[i] and share[i] > SMALL)]
    example = ", ".join(f"{names.states[i]} {_shown(change[i], names.units[i], names.display[i])}" for i in told)
    candidates = [own] if driven[own] else [i for i in told if driven[i]] or [own]
    first = max(candidates, key=lambda i: (round(float(share[i]), 6), -i))
    rest = [i for i in order if i != first and (known[i] or i == own)]
    terms = tuple(
        Term(names.states[i], float(change[i] / change[first]), unit_ratio(names.units[i], names.units[first]))
        for i in (first, *rest)
    )
    printed = [t for t, i in zip(terms, (first, *rest), strict=True) if i in (first, own) or share[i] > UNPRINTED]
    return Direction(combination(printed), terms, example)


def combination(terms: Sequence[Term]) -> str:
    """``a - 2 1/s * b``."""
    text = terms[0].state
    for term in terms[1:]:
        unit = "" if term.unit == "1" else f" {term.unit}"
        size = f"{abs(term.coefficient):.3g}{unit}"
        text += f" {'-' if term.coefficient < 0.0 else '+'} " + (
            term.state if size == "1" else f"{size} * {term.state}"
        )
    return text


def _shown(value: float, unit: str, display: str) -> str:
    """A number in the unit in which people read it: ``-0.00573 deg``."""
    scale = float(parse_unit(unit).scale) / float(parse_unit(display).scale)
    return f"{value * scale:.3g} {display if display != '1' else ''}".strip()
