"""Drop process terms by label."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from estimfw.model.model import Model
from estimfw.policies.change import Change, ChangeKind, FloatArray, Measure, compare

__all__ = ["DropTerm"]


@dataclass(frozen=True, slots=True)
class DropTerm:
    """Drop the terms of these labels, and noise inputs that then drive nothing.

    An operation of the provider that mirrors a term follows. Exact only where a term had no effect whatever the nominal: a
    coefficient that is zero at the reference nominal alone may come alive during the run.

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
        terms = tuple(t for t in model.terms if t not in dropped)
        idle = {t.source for t in dropped} - {t.source for t in terms}
        after = model.with_parts(terms=terms, noises=tuple(n for n in model.noises if n.name not in idle))
        measures = tuple(
            Measure(f"largest entry of {t.label}", _largest(model, t.label, reference), "SI") for t in dropped
        )
        without_effect = all(model.term_matrix(t).is_zero for t in dropped)
        kind: ChangeKind = "mirrored" if self.mirrored else "exact" if without_effect else "approximate"
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
    return float(abs(matrix.evaluate(model.nominal(reference))).max())
