"""The plan of a truth model, and how it lies beside the plan of the filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient, constant
from estimfw.model.model import Model
from estimfw.model.nominal import CorrectionSlot
from estimfw.plan.layout import NominalLayout
from estimfw.plan.lowering import Lowered, lower
from estimfw.plan.plan import Plan, make_plan

__all__ = ["TruthPlan", "make_truth_plan"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TruthPlan:
    """A truth model, compiled over the nominal that the filter's provider makes.

    Attributes
    ----------
    plan : Plan
        Of the truth model.
    model : Model
    map : Lowered
        (filter states, truth states), over the truth plan's layout.
    noises : tuple of (label, Lowered)
        Diffusion (truth states, truth states) of each noise input's axis; their sum is ``plan.D``.
    rows : tuple of int
        For each row of the filter's measurements its place among those of the truth plan, -1 where the truth has none.
    measurements : tuple of int
        For each measurement of the truth plan its place among those of the filter, -1 where the filter has none.
    inputs : tuple of int
        For each known input of the truth plan its place among those of the filter.
    jacobians : tuple of Lowered or None
        For each output of the filter the truth's Jacobian; None where the truth model does not have it.
    """

    plan: Plan
    model: Model
    map: Lowered
    noises: tuple[tuple[str, Lowered], ...]
    rows: tuple[int, ...]
    measurements: tuple[int, ...]
    inputs: tuple[int, ...]
    jacobians: tuple[Lowered | None, ...]

    def design(self, rows: FloatArray) -> FloatArray:
        """The truth's H (..., rows of the filter, truth states) at complete nominal rows; zero where it has no such row."""
        H = self.plan.design(rows)
        padded = np.concatenate([H, np.zeros((*H.shape[:-2], 1, H.shape[-1]))], axis=-2)
        return padded[..., list(self.rows), :]

    def noise(self, interval: FloatArray) -> FloatArray:
        """The truth's R (K, rows of the filter, rows of the filter) for intervals (K, measurements of the filter) in s."""
        ones = np.ones((interval.shape[0], 1))
        R = self.plan.noise(np.hstack([interval, ones])[:, list(self.measurements)])
        padded = np.pad(R, ((0, 0), (0, 1), (0, 1)))
        return padded[:, list(self.rows)][..., list(self.rows)]


def make_truth_plan(model: Model, map: Coefficient, of: Plan, slots: tuple[CorrectionSlot, ...]) -> TruthPlan:
    """Compile a truth model beside the plan of the filter.

    Parameters
    ----------
    model : Model
        The truth model.
    map : Coefficient
        (filter states, truth states).
    of : Plan
        The filter's.
    slots : tuple of CorrectionSlot
        Of the provider.

    Raises
    ------
    ConfigError
        The model needs a nominal variable that the provider does not make, or a known input that the filter does not have.
    """
    layout = NominalLayout(of.layout.variables, (*model.derived, *model.held))
    plan = make_plan(model, layout, slots, of.discretisation, {})
    places = {label: i for i, label in enumerate(label for m in plan.measurements for label in m.labels)}
    owner = {label: j for j, m in enumerate(of.measurements) for label in m.labels}
    outputs = {o.name: jacobian for o, jacobian in plan.outputs}
    return TruthPlan(
        plan=plan,
        model=model,
        map=lower(map, layout),
        noises=_noises(model, layout),
        rows=tuple(places.get(label, -1) for m in of.measurements for label in m.labels),
        measurements=tuple(min((owner[x] for x in m.labels if x in owner), default=-1) for m in plan.measurements),
        inputs=_inputs(plan, of),
        jacobians=tuple(outputs.get(o.name) for o, _ in of.outputs),
    )


def _noises(model: Model, layout: NominalLayout) -> tuple[tuple[str, Lowered], ...]:
    G, Q = model.G, model.Q
    every = range(len(model.states))
    made = []
    for i, label in enumerate(G.columns):
        g = G.coefficient.select(list(every), [i])
        made.append((label, lower(g @ constant([[float(Q[i, i])]]) @ g.T, layout)))
    return tuple(made)


def _inputs(plan: Plan, of: Plan) -> tuple[int, ...]:
    known = [label for k in of.inputs for label in k.labels]
    wanted = [label for k in plan.inputs for label in k.labels]
    for label in wanted:
        if label not in known:
            raise ConfigError(
                f"the truth model has the known input {label!r}, which the filter does not have",
                hint="give the filter's config the same inputs",
            )
    return tuple(known.index(label) for label in wanted)
