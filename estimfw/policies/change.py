"""What a policy did: the record that goes into explain, the result and the report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from estimfw.model.coefficient import Coefficient, constant
from estimfw.model.model import Model

__all__ = ["Change", "Measure", "Policy", "compare", "selection"]

FloatArray = NDArray[np.float64]
ChangeKind = Literal["exact", "mirrored", "approximate"]


@dataclass(frozen=True, slots=True)
class Measure:
    """A number for how well the condition of a policy holds; SI unless ``unit`` says otherwise."""

    name: str
    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.name} {self.value:.3g} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Change:
    """Before and after of one policy.

    Attributes
    ----------
    policy : str
        As the config names it.
    kind : 'exact', 'mirrored' or 'approximate'
        Nothing is lost; nothing is lost if the provider follows; something is lost.
    before, after : tuple of str
        State labels.
    removed_terms : tuple of str
        Process terms that are gone (dropped, or left without effect).
    removed_rows, removed_noises : tuple of str
        Measurement rows and noise inputs that were left without states.
    map : Coefficient
        Linear map of states, after = map @ before.
    condition : str
        When it is true.
    measures : tuple of Measure
        How well the condition holds.
    steps : tuple of Change
        Of a policy that is made of others.
    """

    policy: str
    kind: ChangeKind
    before: tuple[str, ...]
    after: tuple[str, ...]
    removed_terms: tuple[str, ...]
    removed_rows: tuple[str, ...]
    removed_noises: tuple[str, ...]
    map: Coefficient
    condition: str
    measures: tuple[Measure, ...] = ()
    steps: tuple[Change, ...] = ()

    @property
    def removed_states(self) -> tuple[str, ...]:
        """States whose part in the state after is nothing; a re-framed state is not removed."""
        live: list[bool] = np.any(self.map.pattern, axis=0).tolist()
        return tuple(s for s, kept in zip(self.before, live, strict=True) if not kept)

    def as_json(self) -> dict[str, object]:
        """For explain, results and reports; the steps that it is made of are changes too."""
        first = self.measures[0] if self.measures else None
        return {
            "label": self.policy,
            "kind": self.kind,
            "before": list(self.before),
            "after": list(self.after),
            "removed_states": list(self.removed_states),
            "removed_terms": list(self.removed_terms),
            "removed_rows": list(self.removed_rows),
            "removed_noises": list(self.removed_noises),
            "condition": self.condition,
            "number": {"value": first.value, "unit": first.unit, "text": str(first)} if first else None,
            "measures": [{"name": m.name, "value": m.value, "unit": m.unit} for m in self.measures],
            "text": self.condition + ("; " + ", ".join(str(m) for m in self.measures) if self.measures else ""),
            "steps": [step.as_json() for step in self.steps],
        }


class Policy(Protocol):
    """Model -> Model, with a Change. A frozen value."""

    @property
    def label(self) -> str: ...

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        """Rewrite a model.

        Parameters
        ----------
        model : Model
        reference : mapping of str to array
            The nominal frozen at the start (never the noisy record): attitude as given, f = [0, 0, g].

        Raises
        ------
        ConfigError
            Where the policy does not apply, naming what would.
        """
        ...


def selection(before: Model, after: Model) -> Coefficient:
    """The 0/1 map from the states before to those that are left."""
    return constant(
        np.array([[float(a == b) for b in before.states] for a in after.states]).reshape(-1, len(before.states))
    )


def compare(
    policy: str,
    kind: ChangeKind,
    before: Model,
    after: Model,
    condition: str,
    *,
    map: Coefficient | None = None,
    measures: tuple[Measure, ...] = (),
    steps: tuple[Change, ...] = (),
) -> Change:
    """The Change between two models."""

    def gone(old: list[str], new: list[str]) -> tuple[str, ...]:
        return tuple(x for x in old if x not in set(new))

    return Change(
        policy=policy,
        kind=kind,
        before=before.states,
        after=after.states,
        removed_terms=gone([t.label for t in before.terms], [t.label for t in after.terms]),
        removed_rows=gone(_rows(before), _rows(after)),
        removed_noises=_lost_noises(before, after),
        map=map if map is not None else selection(before, after),
        condition=condition,
        measures=measures,
        steps=steps,
    )


def _rows(model: Model) -> list[str]:
    return [label for m in model.measurements for label in m.labels]


def _lost_noises(before: Model, after: Model) -> tuple[str, ...]:
    """Axes of noise inputs that drive nothing any more; an input that only changed its frame is not lost."""
    left = {noise.name: after.settled(noise) for noise in after.noises}
    lost: list[str] = []
    for noise in (before.settled(n) for n in before.noises):
        kept = left.get(noise.name)
        if kept is None or kept.frame == noise.frame:
            lost.extend(x for x in noise.labels if kept is None or x not in kept.labels)
    return tuple(lost)
