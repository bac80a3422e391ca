"""Stages of an estimation: what is believed for a while, in one plan.

A calibration goes in steps: constants first, with one reference; then random drifts, with another. A stage is no other filter. It
says which states are *held* (believed to be known exactly: they keep their value, have no covariance, get no gain) and which are
*considered* (their covariance and correlations are taken into account, but they get no gain: Schmidt), and what is measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from estimfw.plan.lowering import Lowered
    from estimfw.plan.plan import Plan

__all__ = ["Stage", "in_stage", "measured_steps", "stage_of_steps"]

FloatArray = NDArray[np.float64]

#: Instants closer than this (s) are one.
SAME = 1e-9


@dataclass(frozen=True, slots=True)
class Stage:
    """What is believed until an instant.

    Attributes
    ----------
    name : str
    until : float or None, s
        In the record's time: the stage ends with the first step that ends there or later. None: with the run.
    held, considered : (n,) tuple of bool
        By state; no state is both.
    measured : tuple of bool
        By measurement: whether it is due.
    """

    name: str
    until: float | None
    held: tuple[bool, ...]
    considered: tuple[bool, ...]
    measured: tuple[bool, ...]


def stage_of_steps(stages: tuple[Stage, ...], begin: FloatArray) -> NDArray[np.int64]:
    """Which stage each step is in, (K,), by its begin (K,) in s."""
    ends = np.array([s.until for s in stages[:-1]], dtype=float)
    return np.asarray(np.searchsorted(ends, begin + SAME, side="right"), dtype=np.int64)


def measured_steps(stages: tuple[Stage, ...], begin: FloatArray) -> NDArray[np.bool_]:
    """Which measurements the stages measure at each step, (K, measurements), by its begin (K,) in s."""
    return np.array([s.measured for s in stages], dtype=bool)[stage_of_steps(stages, begin)]


def in_stage(plan: Plan, stage: Stage) -> Plan:
    """The plan of a stage: held states keep their value, with no rate and no noise of their own; considered ones get no gain.

    What held states drive is driven by the value that they have.
    """
    plan = replace(plan, considered=stage.considered if any(stage.considered) else ())
    if not any(stage.held):
        return plan
    held, n, inputs = stage.held, len(stage.held), plan.B.shape[1]
    return replace(
        plan,
        F=_silenced(plan.F, {i * n + j for i in range(n) if held[i] for j in range(n)}),
        D=_silenced(plan.D, {i * n + j for i in range(n) for j in range(n) if held[i] or held[j]}),
        B=_silenced(plan.B, {i * inputs + j for i in range(n) if held[i] for j in range(inputs)}),
    )


def _silenced(matrix: Lowered, entries: set[int]) -> Lowered:
    """With zeros there, written out: what has to be evaluated stays the same, and so does the code that is compiled for it."""
    return replace(matrix, monomials=tuple((e, 0.0 if e in entries else c, f) for e, c, f in matrix.monomials))
