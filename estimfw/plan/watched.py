"""What Phi, Q and d depend on along a run: the scalars of a nominal row that have to stay for them to stay."""

from __future__ import annotations

from collections.abc import Iterable

from estimfw.plan.layout import NominalLayout
from estimfw.plan.lowering import Lowered

__all__ = ["watched"]


def watched(layout: NominalLayout, tables: Iterable[Lowered]) -> tuple[int, ...]:
    """Positions in the provided part of a row of all that is not constant and that the tables read, also by derived variables."""
    read = {position for table in tables for _, _, factors in table.monomials for position in factors}
    for d in reversed(layout.derived):  # each is made of earlier ones only
        if read & set(layout.places(d.name)):
            read |= {position for name in d.reads for position in layout.places(name)}
    moving = (layout.places(v.name) for v in layout.variables if v.changes != "constant")
    return tuple(position for places in moving for position in places if position in read)
