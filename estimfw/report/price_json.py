"""A comparison as JSON values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from estimfw.report.price_apart import apart_from_first
from estimfw.report.price_values import Given
from estimfw.run.compare import Comparison, Priced
from estimfw.run.json_value import without_nan

__all__ = ["price_json"]


def price_json(comparison: Comparison, values: Sequence[Given]) -> dict[str, Any]:
    """``filters`` with their costs, ``points`` of the grid, ``values`` by point, time, output and filter; unknown is None."""
    made: dict[str, Any] = without_nan(
        {
            "title": comparison.title,
            "repeats": comparison.repeats,
            "filters": [_filter(one) for one in comparison.filters],
            "points": [{"label": p.label, "overrides": list(p.overrides)} for p in comparison.points],
            "values": [asdict(v) for v in values],
            "apart": [{**asdict(one), "same": one.same} for one in apart_from_first(comparison)],
        }
    )
    return made


def _filter(one: Priced) -> dict[str, Any]:
    cost = one.cost
    return {
        "name": one.name,
        "title": one.title,
        "states": cost.states,
        "nonzeros": {"F": cost.nonzeros_F, "Phi": cost.nonzeros_Phi, "H": cost.nonzeros_H},
        "multiplications": {
            "total": cost.total,
            "predict": cost.predict,
            "update": cost.update,
            "rebuild": cost.rebuild,
            "exponential": cost.exponential,
            "as_run": cost.as_run,
        },
        "time_per_step": {"seconds": one.time.seconds, "ratio": one.time.ratio, "kernel": one.time.kernel},
        "time_invariant": one.time_invariant,
        "reason": one.reason,
        "policies": [{"policy": name, "kind": kind} for name, kind in one.policies],
    }
