"""A partition as sentences, tables, YAML and JSON, for the terminal and the page alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from estimfw.analysis.partition import Cut
from estimfw.report.numbers import UNKNOWN, count, significant
from estimfw.report.tables import Cell, Table
from estimfw.run.partition import PartitionBy, Partitioned

__all__ = [
    "EXACT", "MEASURES", "advice", "basis_texts", "group_table", "nodes_yaml", "objective_text", "partition_json", "price_table",
    "same_cut", "warning_texts",
]  # fmt: skip

#: What a cut keeps together, for people.
MEASURES = {"correlation": "correlation", "coupling": "physical coupling"}

FORM_TEXTS = {
    "drop": "drop: keeps no covariance between nodes",
    "decoupled": "decoupled: each node a filter alone",
}
EXACT = (
    "The exact filter (cross_covariance: exact) has the same estimates and sigmas for every partition, and its work depends on "
    "the sizes alone: estimfw cost tells it. Groups matter for filters that neglect what is between them."
)
PRICED = (
    "True sigma over that of the optimal filter at the end of the run, by dual covariance; the state that suffers most."
)

#: Ratios that differ by less are one.
ALIKE = 1.01


def basis_texts(found: Partitioned) -> list[str]:
    """From what the groups were found, and what stays together."""
    told = f"correlations of the covariance at {_time(found.time)} s, the end of the run"
    if math.isfinite(found.change):
        settled = "converged: " if found.settled else ""
        told += f"; {settled}since {_time(found.since)} s they changed by {significant(found.change, 2)} at most"
    lines = [told]
    bound = [s for s in found.seeds if len(s) > 1]
    if bound:
        groups = " | ".join(", ".join(found.states[i] for i in s) for s in bound)
        lines.append(f"states that one row reads, or rows with a state in common, stay together: {groups}")
    return lines


def warning_texts(found: Partitioned) -> list[str]:
    """What makes the answer doubtful."""
    lines = []
    if not math.isfinite(found.change):
        lines.append("the run is too short to tell whether the covariance has converged")
    elif not found.settled:
        i, j = found.changed
        lines.append(
            f"the covariance has not converged: since {_time(found.since)} s the correlation of {found.states[i]} and "
            f"{found.states[j]} changed by {significant(found.change, 2)}; run longer, or other groups may come out"
        )
    if found.fixed:
        names = ", ".join(found.states[i] for i in found.fixed)
        lines.append(f"no variance at the end, so tied to nothing and put where there was room: {names}")
    without = [n.name for n in found.by_correlation.nodes if not n.rows]
    if without:
        lines.append(f"fewer measurements than groups: {', '.join(without)} measures nothing")
    return lines


def group_table(by: PartitionBy) -> Table:
    """Who owns what."""
    rows = tuple(
        (Cell(n.name), Cell(str(len(n.states))), Cell(", ".join(n.measurements) or UNKNOWN), Cell(", ".join(n.blocks)))
        for n in by.nodes
    )
    return Table(("node", "states", "measures", "blocks and states"), rows, frozenset({1}))


def objective_text(by: PartitionBy, states: Sequence[str]) -> str:
    """J, how it was found, and the next best."""
    cut = by.cut
    what = "sum of |ρ| within groups" if by.measure == "correlation" else "sum of couplings within groups"
    how = f"the best of all {cut.cases} partitions" if cut.exact else "greedy with exchanges: there may be better ones"
    told = f"J = {cut.objective:.6g} ({what}), {'the only partition' if cut.cases == 1 else how}"
    return told if cut.runner_up is None else f"{told}; {_runner_up(cut, states)}"


def _runner_up(cut: Cut, states: Sequence[str]) -> str:
    nearest = "next best" if cut.exact else "best exchange"
    return f"{nearest} J = {cut.runner_up_objective:.6g} ({_difference(cut, states)})"


def _difference(cut: Cut, states: Sequence[str]) -> str:
    """How the next best differs: two states exchanged, else its groups."""
    assert cut.runner_up is not None
    for i, group in enumerate(cut.groups):
        for other in cut.groups[i + 1 :]:
            for a in group:
                for b in other:
                    swapped = {a: b, b: a}
                    made = sorted(tuple(sorted(swapped.get(s, s) for s in g)) for g in cut.groups)
                    if made == sorted(cut.runner_up):
                        return f"{states[a]} and {states[b]} exchanged"
    return " | ".join(", ".join(states[i] for i in g) for g in cut.runner_up)


def same_cut(found: Partitioned) -> bool:
    """Both measures give the same groups."""
    return found.by_correlation.cut.groups == found.by_coupling.cut.groups


def price_table(found: Partitioned) -> Table:
    """What the suboptimal forms cost with the groups of each measure; no rows where nothing was priced."""
    shown = [found.by_correlation] if same_cut(found) else [found.by_correlation, found.by_coupling]
    head = ["form"]
    for by in shown:
        head += [f"by {MEASURES[by.measure]}", "worst state"]
    rows = []
    for k, one in enumerate(found.by_correlation.prices):
        cells = [Cell(FORM_TEXTS[one.form])]
        for by in shown:
            price = by.prices[k]
            worst = float(price.ratio[price.worst])
            cells += [Cell(_times(worst), "" if worst < 1.1 else "warn"), Cell(found.states[price.worst])]
        rows.append(tuple(cells))
    numeric = frozenset(range(1, len(head), 2))
    return Table(tuple(head), tuple(rows), numeric, PRICED)


def _times(ratio: float) -> str:
    """Three digits, or a whole number."""
    return count(round(ratio)) if 1000.0 <= ratio < 1e9 else significant(ratio, 3)


def _time(seconds: float) -> str:
    return f"{seconds:.10g}"


def advice(found: Partitioned) -> str:
    """Which groups to take."""
    if not found.by_correlation.prices:
        return f"Nothing priced: {found.unpriced}."
    if same_cut(found):
        return "Correlation and physical coupling give the same groups."
    ratios = [[float(p.ratio[p.worst]) for p in by.prices] for by in (found.by_correlation, found.by_coupling)]
    better = [b / a for a, b in zip(*ratios, strict=True)]
    if all(b < 1.0 / ALIKE for b in better):
        first = ratios[0][0] / ratios[1][0]
        return (
            "If covariances between nodes are neglected, take the groups by physical coupling: correlations of a converged "
            f"covariance are a bad guide here ({significant(first, 2)} times the error with drop)."
        )
    if all(b > ALIKE for b in better):
        return "If covariances between nodes are neglected, take the groups by correlation."
    if all(1.0 / ALIKE <= b <= ALIKE for b in better):
        return "For filters that neglect covariances between nodes, both cuts are as good."
    names = [by for b in better for by in (["coupling"] if b < 1.0 else ["correlation"])]
    return f"drop is better with the groups by {MEASURES[names[0]]}, decoupled by {MEASURES[names[1]]}."


def nodes_yaml(by: PartitionBy) -> str:
    """The ``nodes`` of ``estimator: {kind: decentralised}``, to be pasted."""
    lines = ["estimator:", "  kind: decentralised", "  nodes:"]
    for node in by.nodes:
        lines.append(f"    - name: {node.name}")
        lines.append(f"      blocks: [{', '.join(map(_quoted, node.blocks))}]")
        lines.append(f"      measurements: [{', '.join(map(_quoted, node.measurements))}]")
    return "\n".join(lines)


def _quoted(label: str) -> str:
    """A bracket ends a list of YAML."""
    return f'"{label}"' if "[" in label else label


def partition_json(found: Partitioned) -> dict[str, Any]:
    """All of it as plain JSON values."""
    return {
        "name": found.name,
        "states": list(found.states),
        "sizes": list(found.sizes),
        "seeds": [[found.states[i] for i in s] for s in found.seeds],
        "time": found.time,
        "converged": found.settled,
        "change": {
            "since": found.since,
            "largest": _finite(found.change),
            "states": [found.states[i] for i in found.changed],
        },
        "without_variance": [found.states[i] for i in found.fixed],
        "correlation": found.correlation.tolist(),
        "partitions": [_by_json(found, by) for by in (found.by_correlation, found.by_coupling)],
        "unpriced": found.unpriced,
        "advice": advice(found),
    }


def _by_json(found: Partitioned, by: PartitionBy) -> dict[str, Any]:
    cut = by.cut

    def named(groups: Sequence[Sequence[int]]) -> list[list[str]]:
        return [[found.states[i] for i in g] for g in groups]

    return {
        "measure": by.measure,
        "groups": named(cut.groups),
        "objective": cut.objective,
        "runner_up": named(cut.runner_up) if cut.runner_up is not None else None,
        "runner_up_objective": _finite(cut.runner_up_objective),
        "exact": cut.exact,
        "cases": cut.cases,
        "nodes": [
            {"name": n.name, "blocks": list(n.blocks), "measurements": list(n.measurements), "states": list(n.states),
             "rows": list(n.rows)}
            for n in by.nodes
        ],
        "true_over_optimal_sigma": {
            p.form: {"largest": float(p.ratio[p.worst]), "state": found.states[p.worst],
                     "by_state": dict(zip(found.states, p.ratio.tolist(), strict=True))}
            for p in by.prices
        },
    }  # fmt: skip


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
