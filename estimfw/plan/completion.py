"""Which derived variables a filter needs in its loop, and where their twins find and leave their numbers in a row."""

from __future__ import annotations

import numpy as np

from estimfw.kernels.completion import Call, Completion
from estimfw.model.derived import DerivedVariable, HeldArgument
from estimfw.plan.layout import NominalLayout
from estimfw.plan.lowering import Lowered, lower
from estimfw.plan.plan import Plan

__all__ = ["completion", "derived_in_loop"]


def derived_in_loop(plan: Plan) -> tuple[DerivedVariable, ...]:
    """Derived variables that dynamics, measurements or the correction read, and those that these are made of, in order."""
    own = {d.name for tables in (_process(plan), _end(plan)) for d in _needed(plan.layout, tables)}
    return tuple(d for d in plan.layout.derived if d.name in own)


def completion(plan: Plan) -> Completion:
    """What the compiled scan does about them; each must have a compiled twin."""
    places = _Places(plan.layout)
    process, end = (tuple(map(places.call, _needed(plan.layout, tables))) for tables in (_process(plan), _end(plan)))
    return Completion(process, end, places.size)


def _process(plan: Plan) -> list[Lowered]:
    return [plan.F, plan.D, plan.B]


def _end(plan: Plan) -> list[Lowered]:
    return [plan.correction, *(table for m in plan.measurements for table in (m.H, m.innovation))]


def _needed(layout: NominalLayout, tables: list[Lowered]) -> list[DerivedVariable]:
    used = {position for table in tables for _, _, factors in table.monomials for position in factors}
    needed = {d.name for d in layout.derived if used & set(layout.places(d.name))}
    for d in reversed(layout.derived):  # each is made of earlier ones only
        if d.name in needed:
            needed |= set(d.reads)
    return [d for d in layout.derived if d.name in needed]


class _Places:
    """Places in a row, and work space behind it for held arguments."""

    def __init__(self, layout: NominalLayout) -> None:
        self.layout, self.size = layout, layout.size
        self.known: dict[tuple[str, str], int] = {}

    def call(self, d: DerivedVariable) -> Call:
        assert d.compiled is not None
        held = {h.name: h for h in d.held}
        arguments, filled = [], list[tuple[int, tuple[tuple[float, tuple[int, ...]], ...]]]()
        for need in d.needs:
            if need in held:
                at = self._space(d.name, held[need])
                filled += self._filled(held[need], at)
                arguments.append((at, at + int(np.prod(held[need].shape, dtype=int))))
            else:
                arguments.append(self._place(need))
        return Call(d.compiled.module, d.compiled.name, tuple(arguments), self._place(d.name), tuple(filled))

    def _place(self, name: str) -> tuple[int, int]:
        own = self.layout.places(name)
        return own.start, own.stop

    def _space(self, name: str, held: HeldArgument) -> int:
        if (name, held.name) not in self.known:
            self.known[name, held.name] = self.size
            self.size += int(np.prod(held.shape, dtype=int))
        return self.known[name, held.name]

    def _filled(self, held: HeldArgument, at: int) -> list[tuple[int, tuple[tuple[float, tuple[int, ...]], ...]]]:
        value = lower(held.value, self.layout)
        return [
            (at + i, tuple((c, factors) for entry, c, factors in value.monomials if entry == i))
            for i in range(value.shape[0])
        ]
