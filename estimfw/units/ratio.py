"""The unit of a quotient, in SI and short: ``rad/s`` over ``rad`` is ``1/s``."""

from __future__ import annotations

from fractions import Fraction

from estimfw.units.table import NAMED_SI
from estimfw.units.unit import Unit
from estimfw.units.unit_text import parse_unit

__all__ = ["unit_ratio"]


def unit_ratio(unit: str, over: str) -> str:
    """Text of ``unit / over`` (SI units), which `parse_unit` reads back; ``1`` where nothing is left.

    Raises
    ------
    ConfigError
        One of them is no unit.
    """
    above, below = parse_unit(unit), parse_unit(over)
    ratio = Unit(above.scale, above.dimension * below.dimension.power(Fraction(-1)))
    named = NAMED_SI.get(ratio.dimension)
    if named is not None or ratio.dimension.is_none or not (_has_name(unit) or _has_name(over)):
        return named or ratio.si_text
    written = unit if below.dimension.is_none else f"({unit})/({over})" if "/" in over else f"{unit}/{over}"
    return min(ratio.si_text, written, key=len)


def _has_name(unit: str) -> bool:
    """Whether it is written with the name of a derived unit (``V``), which is shorter than its bases."""
    return any(name in unit for name in NAMED_SI.values())
