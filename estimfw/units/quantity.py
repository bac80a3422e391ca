"""Read a number with its unit."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction

from estimfw.errors import ConfigError
from estimfw.units.unit import Unit
from estimfw.units.unit_text import MAX_TEXT, parse_unit

__all__ = ["NUMBER_PATTERN", "Quantity", "parse_quantity"]

#: A decimal number; the pattern of the JSON Schemas begins with it.
NUMBER_PATTERN = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*(?P<number>{NUMBER_PATTERN})\s*(?P<unit>.*)", re.DOTALL | re.ASCII)
_EXAMPLES = "write a number and a unit, such as 0.01 deg/h, 100 ug, 0.1 m/s, 10 ug/sqrt(Hz)"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number with its unit.

    Attributes
    ----------
    value : float
        In SI (``unit.si_text``).
    unit : Unit
        The unit as it was written.
    """

    value: float
    unit: Unit


def parse_quantity(text: str) -> Quantity:
    """Read a quantity such as ``0.01 deg/h``; exact up to one rounding (two where pi or a root is in it).

    Parameters
    ----------
    text : str
        One number and a unit. A plain number is a quantity of unit 1.

    Raises
    ------
    ConfigError
        Where the text is no such thing, with examples. Nothing is computed beyond one product.
    """
    if len(text) > MAX_TEXT:
        raise ConfigError(f"{text[:20]!r}... is too long for a quantity ({len(text)} characters)", hint=_EXAMPLES)
    found = _QUANTITY.fullmatch(text.replace("−", "-"))
    if found is None:
        raise ConfigError(f"{text!r} is no quantity: it does not begin with a number", hint=_EXAMPLES)
    rest = found["unit"]
    if rest.startswith(("*", "^")):
        raise ConfigError(
            f"{text!r} is no quantity: {rest[:2].rstrip('0123456789')!r} after the number", hint=_EXAMPLES
        )
    unit = parse_unit(rest)
    number = _exact(found["number"], text)
    try:
        value = unit.scale.times(number)
    except OverflowError:
        value = math.inf
    if math.isinf(value) or (value == 0.0 and number != 0):
        raise ConfigError(f"{text!r} is too {'small' if value == 0.0 else 'large'} for a number", hint=_EXAMPLES)
    return Quantity(value, unit)


def _exact(number: str, text: str) -> Fraction:
    """The number as a fraction, once it is known to be of a sane size."""
    rounded = float(number)
    if not math.isfinite(rounded):
        raise ConfigError(f"{text!r}: {number} is too large for a number", hint=_EXAMPLES)
    if rounded == 0.0 and re.search("[1-9]", re.split("[eE]", number)[0]):
        raise ConfigError(f"{text!r}: {number} is too small for a number", hint=_EXAMPLES)
    return Fraction(number) if rounded else Fraction(0)
