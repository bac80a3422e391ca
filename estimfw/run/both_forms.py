"""One config as the global filter and as the decentralised one, everything else the same."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.generic.kalman import RecursionConfig
from estimfw.config.overrides import with_override
from estimfw.registry.load import load_plugins
from estimfw.run.cost import Nodes

__all__ = ["both_forms"]


def both_forms(problem: Problem, nodes: Nodes) -> tuple[Problem, Problem]:
    """The Kalman filter in Joseph's form, and the exact decentralised one, both in NumPy.

    Settings that both have are kept; gates of a part of a measurement, and silences, are not.

    Parameters
    ----------
    problem : Problem
    nodes : Nodes
        Of the decentralised one.
    """
    given: Mapping[str, Any] = problem.document.data.get("estimator") or {}
    shared = {key: given[key] for key in (*RecursionConfig.model_fields, "loop") if key in given}
    if "gates" in shared:
        whole = {m.name for m in problem.plan.whole.measurements}
        shared["gates"] = {name: gate for name, gate in shared["gates"].items() if name in whole}
    labels = [label for m in problem.plan.measurements for label in m.labels]
    owned = [
        {"name": name, "blocks": [problem.plan.states[i] for i in group], "measurements": [labels[i] for i in rows]}
        for name, group, rows in zip(nodes.names, nodes.groups, nodes.rows, strict=True)
    ]
    one = {**shared, "kind": "kalman", "covariance": "joseph", "kernel": "numpy"}
    return _with(problem, one), _with(problem, {**shared, "kind": "decentralised", "nodes": owned})


def _with(problem: Problem, estimator: Mapping[str, Any]) -> Problem:
    document = problem.document
    made = replace(document, root=with_override(document.root, f"estimator={json.dumps(estimator)}"))
    return compose(made, load_plugins(core_components()))
