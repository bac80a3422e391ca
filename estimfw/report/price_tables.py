"""A comparison as tables, for the terminal and the page alike."""

from __future__ import annotations

import math
from collections.abc import Sequence

from estimfw.report.numbers import count, instant, significant
from estimfw.report.price_values import Given
from estimfw.report.tables import Cell, Table
from estimfw.run.compare import Comparison, Priced

__all__ = ["price_notes", "price_table", "value_table"]

COUNTED = (
    "Ratios are to the first filter. Multiplications are those of a step in which every measurement is fused, by the zero "
    "pattern of Phi and H (covariance symmetric, a component at a time, what varies made anew); 'as run' is the dense kernel. "
    "Times are of this machine."
)
MARKED = "Marked: an error beyond three honest σ; a filter's own σ that is more than 5 % below the honest one."


def price_table(comparison: Comparison) -> Table:
    """A row for each filter: size, work, time, time invariance."""
    head = (
        "filter", "states", "non-zeros F", "H", "multiplications", "ratio", "as run", "µs a step", "ratio",
        "time-invariant",
    )  # fmt: skip
    first = comparison.filters[0]
    rows = tuple(_price_row(one, first) for one in comparison.filters)
    kernels = sorted({one.time.kernel for one in comparison.filters})
    told = (
        f"Median of {comparison.repeats} repeats by turns, provider and filter together; kernel {', '.join(kernels)}."
    )
    return Table(head, rows, frozenset(range(1, 9)), f"{told} {COUNTED}")


def _price_row(one: Priced, first: Priced) -> tuple[Cell, ...]:
    cost = one.cost
    return (
        Cell(one.name),
        Cell(str(cost.states)),
        Cell(str(cost.nonzeros_F)),
        Cell(str(cost.nonzeros_H)),
        Cell(count(cost.total) + ("*" if cost.exponential else "")),
        Cell(significant(cost.total / first.cost.total, 3) if first.cost.total else ""),
        Cell(count(cost.as_run)),
        Cell(significant(1e6 * one.time.seconds, 3)),
        Cell(significant(one.time.ratio, 3)),
        Cell(_invariance(one), "good" if one.in_segments else "warn"),
    )


def _invariance(one: Priced) -> str:
    if one.time_invariant:
        return "yes"
    return "in segments" if one.in_segments else "no"


def _variance(one: Priced) -> str:
    return "time-invariant in segments" if one.in_segments else "not time-invariant"


def price_notes(comparison: Comparison) -> list[str]:
    """Why filters are not time-invariant, and what is not counted."""
    told = [f"{one.name}: {_variance(one)}: {one.reason}" for one in comparison.filters if not one.time_invariant]
    kernels = {one.time.kernel for one in comparison.filters}
    if len(kernels) > 1:
        ran = ", ".join(f"{one.name} {one.time.kernel}" for one in comparison.filters)
        told.append(f"times are of different kernels ({ran}): they tell more of these than of the filters")
    if any(one.cost.exponential for one in comparison.filters):
        told.append("* and a matrix exponential at every step, which is not counted")
    told += [
        f"{one.name}: a bank of {one.members}: non-zeros and multiplications are those of one member, the time is that of all"
        for one in comparison.filters
        if one.members > 1
    ]
    for one in comparison.filters:
        lossy = [name for name, kind in one.policies if kind == "approximate"]
        if lossy:
            told.append(f"{one.name}: approximate by {', '.join(lossy)}")
    return told


def value_table(values: Sequence[Given]) -> Table:
    """Outputs of the filters side by side; what is the same as in the row above is not repeated."""
    varied = any(v.point for v in values)
    known = any(math.isfinite(v.error) for v in values)
    beside = any(math.isfinite(v.published) for v in values)
    head = (
        *(("varied",) if varied else ()), "at, s", "output", "filter", "error" if known else "value",
        *(() if known else ("minus first",)), "σ", "honest σ", "unit", *(("published", "ours minus it") if beside else ()),
    )  # fmt: skip
    rows, before = [], None
    for v in values:
        rows.append(_value_row(v, before, varied=varied, known=known, beside=beside))
        before = v
    numeric = frozenset(i for i, name in enumerate(head) if name not in {"varied", "output", "filter", "unit"})
    return Table(head, tuple(rows), numeric, MARKED if any(cell.tone for row in rows for cell in row) else "")


def _value_row(v: Given, before: Given | None, *, varied: bool, known: bool, beside: bool) -> tuple[Cell, ...]:
    new_point = before is None or v.point != before.point
    new_time = new_point or before is None or v.time != before.time
    new_output = new_time or before is None or v.output != before.output
    shown = (v.error,) if known else (v.value, v.from_first)
    wrong = known and v.honest > 0 and abs(v.error) > 3 * v.honest
    numbers = [Cell(_four(x), "bad" if wrong and i == 0 else "") for i, x in enumerate(shown)]
    short = v.honest > 1.05 * v.sigma
    return (
        *((Cell(v.point if new_point else ""),) if varied else ()),
        Cell(instant(v.time) if new_time else ""),
        Cell(v.output if new_output else ""),
        Cell(v.filter),
        *numbers,
        Cell(significant(v.sigma, 3), "warn" if short else ""),
        Cell(significant(v.honest, 3)),
        Cell(v.unit),
        *((Cell(_four(v.published)), Cell(_four(v.error - v.published))) if beside else ()),
    )


def _four(value: float) -> str:
    """Four decimals where that shows anything, so that columns of errors line up."""
    if not math.isfinite(value) or (value and not 1e-4 <= abs(value) < 1e6):
        return significant(value, 3)
    return f"{value:.4f}"
