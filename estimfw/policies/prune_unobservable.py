"""Delete states that the measurements cannot determine, or pass to the exact quotient without them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from estimfw.analysis.frozen import frozen_stretch
from estimfw.analysis.observability import Observability, piecewise_observability
from estimfw.analysis.removable import independent_states, least_determined_removable
from estimfw.errors import ConfigError
from estimfw.model.coefficient import constant
from estimfw.model.model import Model
from estimfw.policies.change import Change, FloatArray, Measure, compare
from estimfw.policies.drop_states import expand, without_states
from estimfw.policies.quotient import quotient_map, quotient_model, refuse_inexact

__all__ = ["MODES", "PruneMode", "PruneUnobservable", "model_observability"]

PruneMode = Literal["delete", "quotient"]
MODES = (
    "delete: the chosen states are dropped; quotient: nothing is lost, for those that stay stand for combinations with them "
    "(time-invariant models only, and the last policy)"
)


def model_observability(model: Model, reference: Mapping[str, FloatArray]) -> Observability:
    """Observability of a model, frozen at the reference nominal."""
    return piecewise_observability([frozen_stretch(model, reference)], model.prior.evaluate(reference)[1])


@dataclass(frozen=True, slots=True)
class PruneUnobservable:
    """Do without the set of states that is least determined even with perfect knowledge of the observable part.

    On a frozen reference nominal, never on the record. As many states go as the rank is short of the number of states,
    such that the rest is observable. Protected blocks or states are never touched; ties go by state order.

    Attributes
    ----------
    protect : tuple of str
        States or blocks.
    mode : 'delete' or 'quotient'
        Drop the chosen states, or pass to the exact observable quotient, see `estimfw.policies.quotient`.
    """

    protect: tuple[str, ...] = ()
    mode: PruneMode = "delete"

    @property
    def label(self) -> str:
        return "prune_unobservable"

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        protected = set(expand(model, self.protect))
        found = model_observability(model, reference)
        short = len(model.states) - found.rank
        if short == 0:
            condition = f"all {found.rank} states are observable: nothing to prune"
            return model, compare(self.label, "exact", model, model, condition)
        if not found.rank:
            raise ConfigError("prune_unobservable: no state would be left, for no measurement reads any")
        covariance = model.prior.evaluate(reference)[1]
        fixed = [s in protected for s in model.states]
        if self.mode == "quotient":
            chosen: tuple[int, ...] | None = independent_states(found, covariance, fixed) or None
        else:
            chosen = least_determined_removable(found, [frozen_stretch(model, reference)], covariance, fixed)
        if chosen is None:
            raise ConfigError(
                f"prune_unobservable: {short} states must go (rank {found.rank} of {len(model.states)}), "
                f"but the rest stays unobservable unless a protected one goes: {', '.join(sorted(protected))}",
                hint="protect fewer blocks",
            )
        if self.mode == "quotient":
            return self._quotient(model, reference, chosen, found)
        return self._deleted(model, chosen, found)

    def _deleted(self, model: Model, chosen: tuple[int, ...], found: Observability) -> tuple[Model, Change]:
        after = without_states(model, [model.states[i] for i in chosen])
        measures = tuple(
            Measure(f"{model.states[i]} keeps, of its prior sigma,", round(float(found.degree[i]), 6), "")
            for i in chosen
        )
        condition = (
            f"rank {found.rank} of {len(model.states)}: the deleted states are least determined even with perfect knowledge "
            "of the observable part; what they do is taken up by those that stay, whose sigma does not include it"
        )
        return after, compare(self.label, "approximate", model, after, condition, measures=measures)

    def _quotient(
        self, model: Model, reference: Mapping[str, FloatArray], chosen: tuple[int, ...], found: Observability
    ) -> tuple[Model, Change]:
        T = quotient_map(found.kernel, chosen, model.prior.evaluate(reference)[1])
        after = quotient_model(model, T, chosen)
        refuse_inexact(after, reference)
        gone = ", ".join(model.states[i] for i in chosen)
        condition = (
            f"rank {found.rank} of {len(model.states)}: the states that stay stand for combinations with {gone}, and give the "
            "innovations of the whole filter (in closed loop to first order in what is fed back)"
        )
        return after, compare(self.label, "exact", model, after, condition, map=constant(T))
