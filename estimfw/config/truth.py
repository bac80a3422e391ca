"""The truth model of a composed problem: what its errors are measured with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.plan.plan import Plan
from estimfw.plan.truth_plan import TruthPlan, make_truth_plan
from estimfw.policies.change import Change
from estimfw.policies.truth import TruthModel, truth_model
from estimfw.spelling import did_you_mean

__all__ = ["Truth", "own_truth", "truth_of"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Truth:
    """A truth model, and its plan beside that of the filter."""

    model: TruthModel
    plan: TruthPlan


def truth_of(
    full: Model,
    changes: Sequence[Change],
    provider: Any,
    computed: frozenset[str],
    reference: Mapping[str, FloatArray],
    plan: Plan,
    real: Model | None = None,
) -> Truth:
    """The truth of a filter; see `estimfw.policies.truth.truth_model` for the parameters.

    Raises
    ------
    ConfigError
        The truth model cannot be evaluated with this provider.
    """
    made = truth_model(full, changes, provider.operations, computed, reference, real)
    truth = make_truth_plan(made.model, made.map, plan, provider.slots)
    if real is not None:
        _refuse_missing(truth, plan)
    return Truth(made, truth)


def _refuse_missing(truth: TruthPlan, plan: Plan) -> None:
    """What the filter measures or tells has to be there in a truth of another config, or nothing would be true of it."""
    rows = [label for m in plan.measurements for label in m.labels]
    for label, place in zip(rows, truth.rows, strict=True):
        if place < 0:
            known = (label for m in truth.plan.measurements for label in m.labels)
            raise ConfigError(f"the truth model does not measure {label}", hint=did_you_mean(label, known))
    for (output, _), jacobian in zip(plan.outputs, truth.jacobians, strict=True):
        if jacobian is None:
            raise ConfigError(f"the truth model has no output {output.name!r}, which the filter has")


def own_truth(
    full: Model,
    model: Model,
    changes: Sequence[Change],
    provider: Any,
    computed: frozenset[str],
    reference: Mapping[str, FloatArray],
    plan: Plan,
) -> tuple[Truth | None, tuple[str, ...]]:
    """The truth by the filter's own unreduced model, None where it is the filter's; and a warning where it cannot be had.

    A filter that neglects covariances, or believes for a while that states are known, is not right on its own model either, and
    has that as its truth.
    """
    staged = any(any(stage.held) or any(stage.considered) for stage in plan.stages)
    own = plan.separation is None and not staged
    if own and full == model and all(o.name in computed for o in provider.operations):
        return None, ()
    try:
        truth = truth_of(full, changes, provider, computed, reference, plan)
    except ConfigError as error:
        return None, (f"there is no honest sigma: {error.message}",)
    return (truth if not own or truth.model.model != model else None), ()
