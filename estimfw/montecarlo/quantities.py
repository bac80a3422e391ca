"""What is judged: all states together, each block, each state, each physical output."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem

__all__ = ["Quantity", "inverses", "quantities_of", "squares"]

FloatArray = NDArray[np.float64]

ALL_STATES = "all states"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A group of columns (states, then outputs) whose error is squared in units of its covariance."""

    name: str
    kind: str
    columns: tuple[int, ...]

    @property
    def freedom(self) -> int:
        return len(self.columns)


def quantities_of(problem: Problem, known: NDArray[np.bool_]) -> tuple[Quantity, ...]:
    """Those of whose columns the truth is known.

    Parameters
    ----------
    problem : Problem
    known : (states + outputs,) array of bool
    """
    states = [i for i, label in enumerate(problem.plan.states) if known[i]]
    made = [Quantity(ALL_STATES, "states", tuple(states))] if len(states) > 1 else []
    for block in problem.model.blocks:
        at = problem.model.offsets[block.name]
        own = tuple(i for i in range(at, at + len(block.axes)) if known[i])
        if 1 < len(own) < len(states):
            made.append(Quantity(block.name, "block", own))
    made += [Quantity(problem.plan.states[i], "state", (i,)) for i in states]
    labels = [label for output, _ in problem.plan.outputs for label in output.labels]
    n = len(problem.plan.states)
    made += [Quantity(label, "output", (n + i,)) for i, label in enumerate(labels) if known[n + i]]
    return tuple(made)


def squares(error: FloatArray, inverse: FloatArray) -> FloatArray:
    """e' P^-1 e (R, G) for errors (R, G, d) and inverses (R or 1, G, d, d)."""
    return np.asarray(
        np.einsum("rgi,rgij,rgj->rg", error, np.broadcast_to(inverse, (*error.shape, error.shape[-1])), error)
    )


def inverses(covariance: FloatArray) -> FloatArray:
    """Inverses of covariances (R, G, d, d), (1, G, d, d) where all runs share them; NaN where there is none."""
    if covariance.shape[0] > 1 and np.all(covariance == covariance[:1]):
        covariance = covariance[:1]
    sigma = np.sqrt(np.einsum("...ii->...i", covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(sigma > 0.0, 1.0 / sigma, np.nan)
    correlation = covariance * scale[..., :, None] * scale[..., None, :]
    if covariance.shape[-1] == 1:
        return np.asarray(np.square(scale)[..., None])
    try:
        inverse = np.linalg.inv(np.where(np.isfinite(correlation), correlation, np.eye(covariance.shape[-1])))
    except np.linalg.LinAlgError:
        return np.full(covariance.shape, np.nan)
    return np.asarray(inverse * scale[..., :, None] * scale[..., None, :])
