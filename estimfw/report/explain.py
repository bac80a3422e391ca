"""What a composed filter is: its labelled matrices, what each policy did, equivalence, ranks, time invariance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.model.model import Model
from estimfw.plan.plan import Plan
from estimfw.plan.stages import Stage as EstimationStage
from estimfw.policies.prune_unobservable import model_observability
from estimfw.policies.sequence import apply_policies
from estimfw.report.segments import segments_of

__all__ = ["Stage", "explain_json", "stages"]

FloatArray = NDArray[np.float64]


class Stage:
    """A model along the policies: its name, number of states and rank at the reference nominal."""

    def __init__(self, name: str, model: Model, problem: Problem) -> None:
        self.name, self.states = name, len(model.states)
        self.rank = model_observability(model, problem.reference).rank


def stages(problem: Problem) -> list[Stage]:
    """The model as configured, and after each policy."""
    model = problem.full
    found = [Stage("as configured", model, problem)]
    for policy in problem.policies:
        model, _ = apply_policies(model, [policy], problem.reference)
        found.append(Stage(policy.label, model, problem))
    return found


def _estimation_stage(plan: Plan, stage: EstimationStage) -> dict[str, Any]:
    def named(flags: Sequence[bool], names: Iterable[str]) -> list[str]:
        return [name for name, own in zip(names, flags, strict=True) if own]

    return {
        "name": stage.name,
        "until": stage.until,
        "held": named(stage.held, plan.states),
        "considered": named(stage.considered, plan.states),
        "measurements": named(stage.measured, (m.name for m in plan.measurements)),
    }


def explain_json(problem: Problem) -> dict[str, Any]:
    """Everything in SI units, for machines; a varying F stands at the provider's initial nominal."""
    model, nominal = problem.model, problem.reference
    values = model.nominal(nominal)
    H = [model.H(m.name).coefficient.evaluate(values) for m in model.measurements]
    kinds = {m.name: m.noise for m in model.measurements}
    R = [model.R(m.name) for m in model.measurements]
    mean, covariance = model.prior.evaluate(nominal)
    along = stages(problem)
    return {
        "name": problem.config.name,
        "states": list(model.states),
        "state_meanings": list(model.state_meanings),
        "units": list(problem.plan.units),
        "F": model.F.coefficient.evaluate(values).tolist(),
        "G": model.G.coefficient.evaluate(values).tolist(),
        "noise_inputs": list(model.G.columns),
        "Q": model.Q.tolist(),
        "H": np.vstack(H).tolist() if H else [],
        "measurement_rows": [label for m in model.measurements for label in m.labels],
        "R": _block_diagonal(R).tolist(),
        "R_kind": next(iter(kinds.values())) if len(set(kinds.values())) == 1 else kinds,
        "measurements": {
            m.name: {"rows": list(m.labels), "unit": m.unit, "H": h.tolist(), "R": r.tolist(), "R_kind": m.noise}
            for m, h, r in zip(model.measurements, H, R, strict=True)
        },
        "prior": {"mean": mean.tolist(), "covariance": covariance.tolist()},
        "time_invariant": problem.plan.time_invariant,
        "reason": problem.plan.reason,
        "segments": [{"from": one.begin, "matrices": one.matrices} for one in segments_of(problem)],
        "discretisation": problem.plan.discretisation.describe(),
        "terms": [{"label": t.label, "target": t.target, "source": t.source, "text": t.text} for t in model.terms],
        **_nodes(problem.plan),
        "policies": [c.as_json() for c in problem.changes],
        "equivalence": [c.as_json() for c in problem.checks],
        "rank": along[-1].rank,
        "stages": [{"name": s.name, "states": s.states, "rank": s.rank} for s in along],
        "estimation_stages": [_estimation_stage(problem.plan, one) for one in problem.plan.stages],
        "unobservable": list(problem.undetermined),
        "plan_hash": problem.plan.hash,
    }


def _nodes(plan: Plan) -> dict[str, Any]:
    """Who owns what in a decentralised filter."""
    if plan.subsystems is None:
        return {}
    return {
        "nodes": [
            {
                "name": node.name,
                "states": [plan.states[i] for i in node.states],
                "measurements": [plan.measurements[j].name for j in node.measurements],
                "rows": [label for j in node.measurements for label in plan.measurements[j].labels],
            }
            for node in plan.subsystems.nodes
        ]
    }


def _block_diagonal(parts: list[FloatArray]) -> FloatArray:
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*parts), dtype=float) if parts else np.zeros((0, 0))
