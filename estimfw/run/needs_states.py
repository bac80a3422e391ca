"""Analyses of one filter and its covariance refuse a determination, which has neither states nor sigmas, a bank, and stages."""

from __future__ import annotations

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError

__all__ = ["refuse_bank", "refuse_stages", "refuse_without_states"]


def refuse_without_states(problem: Problem, what: str) -> None:
    """Raise `ConfigError` for a determination; ``what`` needs states, such as "an error budget"."""
    if problem.plan.states:
        return
    raise ConfigError(
        f"{what} needs states and their covariance, and a determination has none",
        location=problem.document.locate(("estimator",)),
        hint="estimfw run and estimfw compare tell its errors where the truth is known",
    )


def refuse_bank(problem: Problem, what: str, hint: str) -> None:
    """Raise `ConfigError` for a bank; ``what`` follows one filter, such as "an error budget"."""
    if problem.kind == "bank":
        location = problem.document.locate(("estimator", "kind"))
        raise ConfigError(
            f"{what} follows one filter, and a bank goes from one to another", location=location, hint=hint
        )


def refuse_stages(problem: Problem, what: str, hint: str) -> None:
    """Raise `ConfigError` for a filter with stages; ``what`` follows one model all along, such as "a smoother"."""
    if problem.plan.stages:
        location = problem.document.locate(("estimator", "stages"))
        raise ConfigError(
            f"{what} follows one model, and what is estimated changes from stage to stage", location=location, hint=hint
        )
