"""Analyses that need states refuse a determination, which has none."""

from __future__ import annotations

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError

__all__ = ["refuse_without_states"]


def refuse_without_states(problem: Problem, what: str) -> None:
    """Raise `ConfigError` for a determination; ``what`` needs states, such as "an error budget"."""
    if problem.plan.states:
        return
    raise ConfigError(
        f"{what} needs states and their covariance, and a determination has none",
        location=problem.document.locate(("estimator",)),
        hint="estimfw run and estimfw compare tell its errors where the truth is known",
    )
