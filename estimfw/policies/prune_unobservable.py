"""Delete states that the measurements cannot determine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from estimfw.analysis.frozen import frozen_stretch
from estimfw.analysis.observability import Observability, piecewise_observability
from estimfw.analysis.removable import least_determined_removable
from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.policies.change import Change, FloatArray, Measure, compare
from estimfw.policies.drop_states import expand, without_states

__all__ = ["PruneUnobservable", "model_observability"]


def model_observability(model: Model, reference: Mapping[str, FloatArray]) -> Observability:
    """Observability of a model, frozen at the reference nominal."""
    return piecewise_observability([frozen_stretch(model, reference)], model.prior.evaluate(reference)[1])


@dataclass(frozen=True, slots=True)
class PruneUnobservable:
    """Delete the set of states that is least determined even with perfect knowledge of the observable part.

    On a frozen reference nominal, never on the record. As many states go as the rank is short of the number of states,
    such that the rest is observable. Protected blocks or states are never touched; ties go by state order.
    """

    protect: tuple[str, ...] = ()

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
        frozen = [frozen_stretch(model, reference)]
        chosen = least_determined_removable(found, frozen, covariance, [s in protected for s in model.states])
        if chosen is None:
            raise ConfigError(
                f"prune_unobservable: {short} states must go (rank {found.rank} of {len(model.states)}), "
                f"but the rest stays unobservable unless a protected one goes: {', '.join(sorted(protected))}",
                hint="protect fewer blocks",
            )
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
