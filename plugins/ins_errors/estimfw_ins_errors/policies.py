"""The reductions of this model as named policies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from estimfw.config.types import Settings
from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.policies.change import Change, FloatArray, Policy
from estimfw.policies.drop_term import DropTerm
from estimfw.policies.fix_nominal import FixNominal
from estimfw.policies.sequence import Sequential
from estimfw_ins_errors.local_level import LEFT_OUT

__all__ = ["NeglectMotionConfig", "PaperTermsConfig", "neglect_motion", "paper_terms"]


class PaperTermsConfig(Settings):
    """Drop the first-order terms that eq. (1) leaves out: specific force other than (0, 0, g), radii at a wrong latitude."""

    kind: Literal["ins_errors.paper_terms"]


class NeglectMotionConfig(Settings):
    """V = 0 in the coefficients: a slow vehicle."""

    kind: Literal["ins_errors.neglect_motion"]


@dataclass(frozen=True, slots=True)
class PaperTerms:
    """Drops those of `LEFT_OUT` that the model has."""

    label: str = field(default="ins_errors.paper_terms", init=False)

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        """ConfigError where the model is eq. (1) already."""
        there = tuple(t.label for t in model.terms if t.label in LEFT_OUT)
        if not there:
            raise ConfigError(
                "the model has none of the terms that eq. (1) leaves out",
                hint="its process has terms: paper already; say terms: complete, or leave the policy out",
            )
        condition = "the vehicle does not accelerate, and the forces of its motion are small against g"
        return Sequential(self.label, (DropTerm(there),), condition).apply(model, reference)


def paper_terms(cfg: PaperTermsConfig) -> Policy:
    return PaperTerms()


def neglect_motion(cfg: NeglectMotionConfig) -> Policy:
    condition = "the vehicle is slow: its velocity moves the errors less than the Earth's rate does"
    return Sequential("ins_errors.neglect_motion", (FixNominal("velocity_t", (0.0, 0.0)),), condition)
