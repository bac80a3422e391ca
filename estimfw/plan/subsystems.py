"""A plan cut into subsystems: each node owns states and measurements; a measurement of several nodes becomes one for each.

Nothing is lost by the cut: the noise between rows of one measurement that now belong to two is kept (`Subsystems.noise`), so the
plan stands for the same filter. Measurements come in the order of the nodes, which is the order in which they are fused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from estimfw.plan.lowering import Lowered
from estimfw.plan.separation import Form, Separation

if TYPE_CHECKING:
    from estimfw.plan.plan import MeasurementPlan, Plan

__all__ = ["NoiseBetween", "Subsystem", "Subsystems", "cut"]


@dataclass(frozen=True, slots=True)
class Subsystem:
    """A node.

    Attributes
    ----------
    name : str
    states : tuple of int
        Its states, ascending.
    measurements : tuple of int
        Its measurements in the cut plan.
    """

    name: str
    states: tuple[int, ...]
    measurements: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class NoiseBetween:
    """R (rows of ``first``, rows of ``second``) between two measurements that were one."""

    first: int
    second: int
    R: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Subsystems:
    """Who owns what.

    Attributes
    ----------
    nodes : tuple of Subsystem
    noise : tuple of NoiseBetween
        In the measure of the measurements' own R; only what is not zero.
    separation : Separation or None
        None: the exact filter.
    whole : Plan
        As it was before.
    """

    nodes: tuple[Subsystem, ...]
    noise: tuple[NoiseBetween, ...]
    separation: Separation | None
    whole: Plan

    def owner(self, measurement: int) -> int:
        """The node that owns a measurement of the cut plan."""
        return next(i for i, node in enumerate(self.nodes) if measurement in node.measurements)


def cut(plan: Plan, nodes: Sequence[tuple[str, Sequence[int], Sequence[int]]], form: Form | None = None) -> Plan:
    """The plan with subsystems.

    Parameters
    ----------
    plan : Plan
    nodes : sequence of (name, states, rows)
        Every state and every row (counted over all measurements, one behind the other) in exactly one.
    form : 'drop' or 'decoupled', optional
        A suboptimal form; left out: exact. ``decoupled`` takes from each row what it reads of other nodes' states.
    """
    parts: list[_Part] = []
    made: list[Subsystem] = []
    for name, states, rows in nodes:
        own = _parts(plan, name, set(states) if form == "decoupled" else None, set(rows))
        made.append(Subsystem(name, tuple(sorted(states)), tuple(range(len(parts), len(parts) + len(own)))))
        parts += own
    measurements = tuple(part.made for part in parts)
    separation = None if form is None else _separation(form, len(plan.states), made, measurements)
    noise = tuple(_noise_between(plan, parts)) if form is None else ()
    return replace(plan, measurements=measurements, subsystems=Subsystems(tuple(made), noise, separation, plan))


@dataclass(frozen=True, slots=True)
class _Part:
    """Rows of a measurement of the whole plan, and the measurement that they become."""

    measurement: int
    rows: tuple[int, ...]
    made: MeasurementPlan


def _parts(plan: Plan, node: str, within: set[int] | None, rows: set[int]) -> list[_Part]:
    """Those of one node; of states ``within`` alone where that is given."""
    found, at = [], 0
    for j, m in enumerate(plan.measurements):
        own = tuple(i for i in range(m.rows) if at + i in rows)
        at += m.rows
        if own:
            part = m if len(own) == m.rows else _selected(m, own, f"{m.name}@{node}")
            found.append(_Part(j, own, part if within is None else replace(part, H=_within(part.H, within))))
    return found


def _selected(m: MeasurementPlan, rows: tuple[int, ...], name: str) -> MeasurementPlan:
    return replace(
        m,
        name=name,
        labels=tuple(m.labels[i] for i in rows),
        H=_rows_of(m.H, rows),
        innovation=_rows_of(m.innovation, rows),
        R=tuple(tuple(m.R[i][j] for j in rows) for i in rows),
        columns=tuple(m.columns[i] for i in rows) if m.columns else (),
    )


def _rows_of(lowered: Lowered, rows: tuple[int, ...]) -> Lowered:
    width, place = lowered.shape[1], {row: i for i, row in enumerate(rows)}
    kept = tuple(
        (place[entry // width] * width + entry % width, constant, factors)
        for entry, constant, factors in lowered.monomials
        if entry // width in place
    )
    return Lowered((len(rows), width), kept)


def _within(H: Lowered, states: set[int]) -> Lowered:
    width = H.shape[1]
    return Lowered(H.shape, tuple(one for one in H.monomials if one[0] % width in states))


def _noise_between(plan: Plan, parts: Sequence[_Part]) -> Iterator[NoiseBetween]:
    for b, second in enumerate(parts):
        for a, first in enumerate(parts[:b]):
            if first.measurement == second.measurement:
                R = plan.measurements[first.measurement].R
                between = tuple(tuple(R[i][j] for j in second.rows) for i in first.rows)
                if any(value != 0.0 for row in between for value in row):
                    yield NoiseBetween(a, b, between)


def _separation(form: Form, n: int, nodes: Sequence[Subsystem], measurements: Sequence[MeasurementPlan]) -> Separation:
    of = {state: i for i, node in enumerate(nodes) for state in node.states}
    rows = tuple(i for i, node in enumerate(nodes) for j in node.measurements for _ in range(measurements[j].rows))
    return Separation(form, tuple(of[state] for state in range(n)), rows)
