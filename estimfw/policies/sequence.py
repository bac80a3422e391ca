"""A named policy made of others, and the application of a whole list in order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.policies.change import Change, ChangeKind, FloatArray, Policy, compare
from estimfw.policies.order import LostAxisError

__all__ = ["Sequential", "apply_policies"]


@dataclass(frozen=True, slots=True)
class Sequential:
    """Policies under one name: what a plugin registers for its domain.

    Attributes
    ----------
    name : str
    steps : tuple of Policy
    condition : str
        When the whole is true; empty: what those steps say that decide the kind of the whole.
    kind : str or None
        None: the worst kind of the steps.
    """

    name: str
    steps: tuple[Policy, ...]
    condition: str = ""
    kind: ChangeKind | None = None

    @property
    def label(self) -> str:
        return self.name

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        after, changes = apply_policies(model, self.steps, reference)
        ranking: tuple[ChangeKind, ...] = ("exact", "mirrored", "approximate")
        worst = ranking[max((ranking.index(c.kind) for c in changes), default=0)]
        total = None
        for change in changes:
            total = change.map if total is None else change.map @ total
        measures = tuple(m for c in changes for m in c.measures)
        told = dict.fromkeys(c.condition for c in changes if c.kind == worst)
        change = compare(
            self.name,
            self.kind or worst,
            model,
            after,
            self.condition or "; ".join(told),
            map=total,
            measures=measures,
            steps=tuple(changes),
        )
        return after, change


def apply_policies(
    model: Model, policies: Sequence[Policy], reference: Mapping[str, FloatArray], earlier: Sequence[Change] = ()
) -> tuple[Model, list[Change]]:
    """Apply in order; ``earlier`` is what was done to the model before, for the messages.

    Raises
    ------
    ConfigError
        Of the first that does not apply, with its name.
    """
    changes: list[Change] = []
    for policy in policies:
        if model.quotient is not None:
            raise ConfigError(
                f"policy {policy.label!r}: the states are those of an exact quotient, which a further change would spoil",
                hint=f"put {policy.label!r} before prune_unobservable in mode quotient, which acts last",
            )
        try:
            model, change = policy.apply(model, reference)
        except LostAxisError as error:
            raise error.as_met_in(policy.label, [*earlier, *changes]) from error
        except ConfigError as error:
            if error.message.startswith("policy "):
                raise
            raise ConfigError(f"policy {policy.label!r}: {error.message}", hint=error.hint) from error
        changes.append(change)
    return model, changes
