"""Numbers whose unit another key of the same mapping names (``unit: m/s``)."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic_core import PydanticCustomError

from estimfw.config.quantity_types import refuse
from estimfw.config.unit_examples import examples_of
from estimfw.data.memory import refuse_too_large
from estimfw.errors import ConfigError
from estimfw.units.display import si_name
from estimfw.units.quantity import parse_quantity
from estimfw.units.unit_text import parse_unit

__all__ = [
    "STATE_BYTES",
    "as_config_error",
    "not_negative",
    "numbers_in",
    "product_unit",
    "refuse_odd_units",
    "refuse_too_many_states",
    "refuse_twice",
]

#: A pair of states costs so many bytes before the run: the prior as numbers, F, D and their products.
STATE_BYTES = 400.0


def numbers_in(
    values: str | float | Sequence[str | float], unit: str, count: int, what: str, *, inside: tuple[str | int, ...] = ()
) -> tuple[float, ...]:
    """SI numbers.

    Parameters
    ----------
    values : text with unit, or a list of them
        One for all, or ``count`` of them. Plain numbers are taken where the unit is 1.
    unit : str
        The dimension that they must have.
    count : int
    what : str
        The key that holds them.
    inside : tuple of str and int
        Where that key stands in the settings, if not at their top.

    Raises
    ------
    PydanticCustomError
        What `estimfw.config.validate` turns into a ConfigError at the key ``what`` (`as_config_error` does it elsewhere).
    """
    if isinstance(values, str) or not isinstance(values, Sequence):
        return (_number(values, unit, (*inside, what)),) * count
    if len(values) != count:
        refuse(f"{len(values)} values where {count} are due", "one for each axis, or one for all", (*inside, what))
    return tuple(_number(item, unit, (*inside, what, i)) for i, item in enumerate(values))


def not_negative(numbers: Sequence[float], values: object, what: str) -> None:
    """Refuse a negative one among the SI numbers of ``values``."""
    for i, number in enumerate(numbers):
        if number < 0.0:
            several = isinstance(values, (list, tuple))
            shown = values[i] if isinstance(values, (list, tuple)) else values
            refuse(f"{what} is negative: {shown!r}", "zero or more is due", (what, i) if several else (what,))


def refuse_twice(names: Sequence[str], key: str) -> None:
    """Refuse a name that stands twice in the list ``key``."""
    seen: set[str] = set()
    for i, name in enumerate(names):
        if name in seen:
            refuse(f"{name!r} stands twice", "each needs a name of its own", (key, i))
        seen.add(name)


def refuse_too_many_states(count: int) -> None:
    """Refuse a block whose covariance alone fills the memory."""
    try:
        refuse_too_large(STATE_BYTES * count * count, f"{count} states", "fewer `axes`")
    except ConfigError as error:
        refuse(error.message, error.hint, "axes")


def refuse_odd_units(unit: str, display_unit: str) -> None:
    """The unit of states is an SI one (numbers are SI inside), that of displays any of its dimension."""
    for name, text in (("unit", unit), ("display_unit", display_unit)):
        try:
            found = parse_unit(text or unit)
        except ConfigError as error:
            refuse(error.message, error.hint, name)
        if name == "unit" and float(found.scale) != 1.0:
            refuse(f"{unit!r} is no SI unit", f"say unit: {si_name(found)} and display_unit: {unit}", name)
        if found.dimension != parse_unit(unit).dimension:
            refuse(f"{text!r} is in {si_name(found)}, not in {unit}", f"such as {unit}", name)


def as_config_error(error: PydanticCustomError) -> ConfigError:
    """For a fault that is found outside of pydantic's validation."""
    context = error.context or {}
    return ConfigError(str(context["message"]), hint=str(context["hint"]) or None, within=tuple(context.get("at", ())))


def _number(item: str | float, unit: str, at: tuple[str | int, ...]) -> float:
    try:
        wanted = parse_unit(unit)
    except ConfigError as error:
        refuse(error.message, error.hint, "unit")
    expected = f"expected a quantity in {si_name(wanted)}, such as {' or '.join(examples_of(unit))}"
    if not isinstance(item, str):
        if not wanted.dimension.is_none:
            refuse(f"{item!r} has no unit", expected, at)
        return float(item)
    try:
        quantity = parse_quantity(item)
    except ConfigError as error:
        refuse(error.message, expected, at)
    if quantity.unit.dimension != wanted.dimension:
        refuse(f"{item!r} is in {si_name(quantity.unit)}, not in {si_name(wanted)}", expected, at)
    return quantity.value


def product_unit(unit: str, factor: str) -> str:
    """The unit of a product, as text: ``m/s`` times ``sqrt(s)`` is ``(m/s)*sqrt(s)``."""
    return f"({unit})*{factor}" if unit != "1" else factor
