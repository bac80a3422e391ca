"""Numbers whose unit another key of the same mapping names (``unit: m/s``)."""

from __future__ import annotations

from collections.abc import Sequence

from estimfw.errors import ConfigError
from estimfw.units.quantity import parse_quantity
from estimfw.units.unit_text import parse_unit

__all__ = ["numbers_in", "product_unit"]


def numbers_in(values: str | float | Sequence[str | float], unit: str, count: int, what: str) -> tuple[float, ...]:
    """SI numbers.

    Parameters
    ----------
    values : text with unit, or a list of them
        One for all, or ``count`` of them. Plain numbers are taken where the unit is 1.
    unit : str
        The dimension that they must have.
    count : int
    what : str
        For the message.

    Raises
    ------
    ValueError
        As pydantic wants it: it then names file, line and column.
    """
    items = list(values) if isinstance(values, Sequence) and not isinstance(values, str) else [values] * count
    if len(items) != count:
        raise ValueError(f"{what} has {len(items)} values, {count} are due (one for each axis, or one for all)")
    return tuple(_number(item, unit, what) for item in items)


def _number(item: str | float, unit: str, what: str) -> float:
    try:
        wanted = parse_unit(unit)
        if not isinstance(item, str):
            if not wanted.dimension.is_none:
                raise ValueError(f"{what} = {item} has no unit; write for example '{item} {unit}'")
            return float(item)
        quantity = parse_quantity(item)
    except ConfigError as error:
        raise ValueError(f"{what}: {error.message}" + (f"; {error.hint}" if error.hint else "")) from error
    if quantity.unit.dimension != wanted.dimension:
        raise ValueError(
            f"{what} = {item!r} has the unit {quantity.unit.dimension}, it needs {unit} (such as '1 {unit}')"
        )
    return quantity.value


def product_unit(unit: str, factor: str) -> str:
    """The unit of a product, as text: ``m/s`` times ``sqrt(s)`` is ``(m/s)*sqrt(s)``."""
    return f"({unit})*{factor}" if unit != "1" else factor
