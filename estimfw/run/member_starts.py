"""The starts of a bank's members: spread around one, or several that were found; a plain filter has one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.config.generic.estimation import StartSpread
from estimfw.errors import ConfigError, DataError
from estimfw.model.nominal import CorrectionSlot, InitialNominal
from estimfw.spelling import did_you_mean
from estimfw.units.display import si_name
from estimfw.units.unit_text import parse_unit

__all__ = ["MemberStart", "member_starts"]

FloatArray = NDArray[np.float64]
PATH = ("estimator", "starts")


@dataclass(frozen=True, slots=True)
class MemberStart:
    """Where a member starts, and its name for people: ``attitude[U] +45 deg``."""

    start: InitialNominal
    label: str


def member_starts(problem: Problem, start: InitialNominal) -> tuple[MemberStart, ...]:
    """One for each member.

    Parameters
    ----------
    problem : Problem
    start : InitialNominal
        As the provider will have it; its values may have a leading axis over starts.

    Raises
    ------
    ConfigError
        The spread names no quantity of the start, or not one of its axes; several starts, and no bank; a bank of one start that
        does not say how the others differ.
    """
    count = _found(problem, start)
    if problem.kind != "bank":
        if count is not None:
            raise DataError(
                f"the start is {count} candidates, and one filter starts from one",
                hint="run one from each and take the likeliest: estimator: {kind: bank, filter: {kind: kalman}}",
            )
        return (MemberStart(start, start.source),)
    if count is not None:
        if problem.starts is not None:
            raise _refused(problem, (), f"the start is {count} candidates already", "leave out `starts`")
        return tuple(_candidate(problem, start, i) for i in range(count))
    if problem.starts is None:
        raise _refused(
            problem, (), "the members of a bank differ in their start, and nothing says how",
            "such as starts: {quantity: attitude, axis: U, count: 8, spacing: 45 deg}",
        )  # fmt: skip
    return _spread(problem, problem.starts, start)


def _found(problem: Problem, start: InitialNominal) -> int | None:
    """The length of the leading axis that values have; None without one."""
    shapes = {v.name: v.shape for v in problem.plan.layout.variables}
    leads = {np.shape(v)[: np.ndim(v) - len(shapes[n])] for n, v in start.values.items() if n in shapes}
    several = sorted(lead[0] for lead in leads if lead)
    if len(set(several)) > 1:
        raise DataError(f"the values of a start are for {' and for '.join(map(str, several))} candidates")
    return several[0] if several else None


def _candidate(problem: Problem, start: InitialNominal, i: int) -> MemberStart:
    shapes = {v.name: v.shape for v in problem.plan.layout.variables}
    own = {
        name: np.asarray(value)[i] if name in shapes and np.ndim(value) > len(shapes[name]) else value
        for name, value in start.values.items()
    }
    label = start.candidates[i] if len(start.candidates) > i else f"start {i + 1}"
    return MemberStart(replace(start, values=own), label)


def _spread(problem: Problem, spread: StartSpread, start: InitialNominal) -> tuple[MemberStart, ...]:
    name = _variable(problem, spread.quantity, start)
    value = np.asarray(start.values[name], dtype=float)
    _refuse_odd_unit(problem, spread, name, value)
    move = _move(problem, spread, value)
    made = []
    for k in spread.steps:
        moved = replace(start, values={**start.values, name: move(k * spread.spacing.value)}) if k else start
        made.append(MemberStart(moved, _label(spread, k)))
    return tuple(made)


def _variable(problem: Problem, quantity: str, start: InitialNominal) -> str:
    """The value of the start that a quantity means: that of its name, or what the correction slot of its name corrects."""
    if quantity in start.values:
        return quantity
    corrected = {slot.quantity: _corrected(slot, start) for slot in problem.provider.slots}
    if corrected.get(quantity):
        return corrected[quantity]
    known = sorted({*start.values, *(name for name, value in corrected.items() if value)})
    raise _refused(
        problem, ("quantity",), f"the start has no {quantity!r} to be spread",
        f"{did_you_mean(quantity, known)}; it has: {', '.join(known) or 'nothing'}",
    )  # fmt: skip


def _corrected(slot: CorrectionSlot, start: InitialNominal) -> str:
    """The value that a slot corrects: ``velocity_n`` of velocity in n, else the only rotation; empty where there is none."""
    if f"{slot.quantity}_{slot.frame}" in start.values:
        return f"{slot.quantity}_{slot.frame}"
    turns = [name for name, value in start.values.items() if np.shape(value) == (3, 3)]
    return turns[0] if slot.quantity == "attitude" and len(turns) == 1 else ""


def _move(problem: Problem, spread: StartSpread, value: FloatArray) -> Callable[[float], FloatArray]:
    """How a value is moved by so much: turned about an axis, or added to."""
    if value.ndim == 0:
        if spread.axis is not None:
            raise _refused(problem, ("axis",), f"{spread.quantity!r} is one number, without axes", "leave out `axis`")
        return lambda by: value + by
    place = _place(problem, spread, value.shape[-1])
    if value.ndim == 1:
        unit = np.eye(value.size)[place]
        return lambda by: value + by * unit
    if value.shape != (3, 3):
        raise _refused(problem, ("quantity",), f"{spread.quantity!r} is a matrix {value.shape}, and no rotation", "")
    return lambda by: _turn(place, by) @ value


def _place(problem: Problem, spread: StartSpread, size: int) -> int:
    axes = {axis: f.axes.index(axis) for f in reversed(problem.full.frames) for axis in f.axes} if size == 3 else {}
    place = spread.axis if isinstance(spread.axis, int) else axes.get(str(spread.axis), -1)
    if 0 <= place < size:
        return place
    hint = f"one of {', '.join(axes)}" if axes else f"a place from 0 to {size - 1}"
    raise _refused(problem, ("axis",), f"{spread.quantity!r} has no axis {spread.axis!r}", hint)


def _turn(axis: int, angle: float) -> FloatArray:
    """The rotation about an axis, (3, 3); exact where it is one of no angle."""
    c, s = np.cos(angle), np.sin(angle)
    made = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    made[i, i] = made[j, j] = c
    made[i, j], made[j, i] = -s, s
    return made


def _refuse_odd_unit(problem: Problem, spread: StartSpread, name: str, value: FloatArray) -> None:
    units = {v.name: v.unit for v in problem.plan.layout.variables}
    unit = "rad" if value.ndim == 2 else units.get(name, "SI")
    if unit != "SI" and parse_unit(unit).dimension != spread.spacing.unit.dimension:
        text = f"{spread.quantity!r} is in {si_name(parse_unit(unit))}, not in {si_name(spread.spacing.unit)}"
        raise _refused(problem, ("spacing",), text, "such as 45 deg for a rotation")


def _label(spread: StartSpread, k: int) -> str:
    unit = spread.spacing.unit
    shown = f"{k * spread.spacing.value / float(unit.scale):+.6g} {unit.text}" if k else "as given"
    axis = "" if spread.axis is None else f"[{spread.axis}]"
    return f"{spread.quantity}{axis} {shown}".strip()


def _refused(problem: Problem, inside: tuple[str, ...], text: str, hint: str) -> ConfigError:
    return ConfigError(
        f"estimator.starts: {text}", location=problem.document.locate((*PATH, *inside)), hint=hint or None
    )
