"""Whether a quotient is exact for the plan that runs: nothing varies that it was made of, and the provider stays the same."""

from __future__ import annotations

from typing import Any

from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.plan.equivalence import settle_operations
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import Plan, varying

__all__ = ["refuse_inexact_quotient"]

HINT = "use mode: delete, or first take the policies that make the model time-invariant (see `estimfw explain`)"


def refuse_inexact_quotient(model: Model, plan: Plan, provider: Any, computed: frozenset[str]) -> None:
    """Nothing for a model that is no quotient.

    Raises
    ------
    ConfigError
        The model that it was made of, or what is left, is time-varying; or the provider would leave out an operation for it.
    """
    if model.quotient is None:
        return
    full = model.quotient.of
    layout = NominalLayout(provider.variables(computed), (*full.derived, *full.held))
    reasons = dict.fromkeys([*varying(full, layout), *plan.varying])
    if reasons:
        told = "; ".join(f"{what} needs {variable}, which is {change}" for what, variable, change in reasons)
        raise ConfigError(
            f"prune_unobservable: a quotient is exact for a time-invariant plan only, and this one varies: {told}",
            hint=HINT,
        )
    lost = _mirrored(full, provider) - _mirrored(model, provider)
    if lost:
        names = ", ".join(sorted(lost))
        raise ConfigError(
            f"prune_unobservable: without the states that go, the nominal would leave out {names}, so the quotient is not exact",
            hint="protect these states, or use mode: delete",
        )


def _mirrored(model: Model, provider: Any) -> set[str]:
    """Operations whose mirror the model has."""
    checks = settle_operations(provider.operations, {}, model.structure, provider.kind, allow_mismatch=True)
    return {c.operation for c in checks if c.in_model}
