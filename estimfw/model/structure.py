"""The view of a model that a nominal provider gets: which terms and axes live."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Structure"]


@dataclass(frozen=True, slots=True)
class Structure:
    """Which labels and axes live: what a nominal provider gets to see of a model."""

    terms: frozenset[str]
    axes: frozenset[tuple[str, str]]

    def has_term(self, label: str) -> bool:
        return label in self.terms

    def has_axis(self, quantity: str, axis: str | None = None) -> bool:
        """Whether a block of this quantity has this axis (any axis if None)."""
        return any(q == quantity and axis in (None, a) for q, a in self.axes)
