"""Drop process terms by label."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from estimfw.model.model import Model
from estimfw.policies.change import Change, ChangeKind, FloatArray, Measure, compare

__all__ = ["DropTerm"]


@dataclass(frozen=True, slots=True)
class DropTerm:
    """Drop the terms of these labels; an operation of the provider that mirrors one follows.

    Attributes
    ----------
    terms : tuple of str
    mirrored : bool
        Whether a provider's operation mirrors the term (so that both sides drop it).
    """

    terms: tuple[str, ...]
    mirrored: bool = False

    @property
    def label(self) -> str:
        return f"drop_term {', '.join(self.terms)}"

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        dropped = [model.term(label) for label in self.terms]
        after = model.with_parts(terms=tuple(t for t in model.terms if t not in dropped))
        measures = tuple(
            Measure(f"largest entry of {t.label}", _largest(model, t.label, reference), "SI") for t in dropped
        )
        kind: ChangeKind = (
            "mirrored" if self.mirrored else "exact" if all(m.value == 0.0 for m in measures) else "approximate"
        )
        condition = (
            "exact if the provider drops the mirrored operation too"
            if self.mirrored
            else "the dropped terms are negligible"
        )
        return after, compare(self.label, kind, model, after, condition, measures=measures)


def _largest(model: Model, label: str, reference: Mapping[str, FloatArray]) -> float:
    matrix = model.term_matrix(model.term(label))
    if matrix.is_zero:
        return 0.0
    return float(abs(matrix.evaluate(reference)).max())
