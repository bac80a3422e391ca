"""An error budget as tables, as sentences and as JSON."""

from __future__ import annotations

from typing import Any

from estimfw.report.numbers import plain, significant
from estimfw.report.tables import Cell, Table
from estimfw.run.budget import Budget

__all__ = ["budget_json", "largest_texts", "shown_quantities", "source_table"]

NEGLIGIBLE = 1e-3
"""Part of the total sigma below which a contribution is written as 0."""


def shown_quantities(budget: Budget) -> range:
    """The outputs; the states of a filter without outputs."""
    return range(budget.outputs) if budget.outputs else range(len(budget.quantities))


def largest_texts(budget: Budget) -> list[str]:
    """For each shown quantity its sigma at the end and the three largest sources of it."""
    texts = []
    for i in shown_quantities(budget):
        scale, unit = budget.scales[i], budget.units[i]
        parts = [
            f"{budget.sources[s].kind} {budget.sources[s].name} "
            f"{significant(budget.contributions[-1, s, i] * scale, 2)} ({100.0 * budget.shares[-1, s, i]:.0f} %)"
            for s in budget.largest(i)
        ]
        told = "; ".join(parts) or "nothing contributes"
        texts.append(f"{budget.quantities[i]}: {significant(budget.total[-1, i] * scale, 2)} {unit}: {told}")
    return texts


def source_table(budget: Budget, row: int = -1) -> Table:
    """Contribution of each source to the sigma of each shown quantity at one of the times, the total and the filter's own."""
    shown = list(shown_quantities(budget))
    order = sorted(
        range(len(budget.sources)), key=lambda s: -max((budget.shares[row, s, i] for i in shown), default=0.0)
    )
    head = ("source", "", *(f"{budget.quantities[i]}, {budget.units[i]}" for i in shown))

    def numbers(values: Any) -> tuple[Cell, ...]:
        return tuple(Cell(significant(float(values[i] * budget.scales[i]), 2)) for i in shown)

    def contribution(s: int) -> tuple[Cell, ...]:
        cells = numbers(budget.contributions[row, s])
        share = budget.shares[row, s]
        return tuple(Cell(c.text if share[i] >= NEGLIGIBLE**2 else "0") for c, i in zip(cells, shown, strict=True))

    rows = [(Cell(budget.sources[s].name), Cell(budget.sources[s].kind), *contribution(s)) for s in order]
    rows.append((Cell("total: honest sigma"), Cell(""), *numbers(budget.total[row])))
    rows.append((Cell("the filter's own sigma"), Cell(""), *numbers(budget.own[row])))
    note = "Squares of the contributions add up to the square of the total. 0: less than a thousandth of the total."
    return Table(head, tuple(rows), frozenset(range(2, 2 + len(shown))), note)


def budget_json(budget: Budget) -> dict[str, Any]:
    """All of it as plain JSON values, SI units."""
    return {
        "title": budget.name,
        "truth": budget.truth_name,
        "zero_in_truth": list(budget.absent),
        "time": budget.time.tolist(),
        "sources": [{"kind": s.kind, "name": s.name} for s in budget.sources],
        "quantities": [
            {
                "label": label,
                "display_unit": budget.units[i],
                "display_scale": float(budget.scales[i]),
                "honest_sigma": budget.total[:, i].tolist(),
                "own_sigma": budget.own[:, i].tolist(),
                "contributions": budget.contributions[:, :, i].T.tolist(),
                "largest": [budget.sources[s].name for s in budget.largest(i)],
            }
            for i, label in enumerate(budget.quantities)
        ],
        "end": plain(float(budget.time[-1])),
    }
