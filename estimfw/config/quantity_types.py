"""Pydantic annotations for physical numbers: text with a unit in, floats in SI out.

``sigma: Annotated[float, non_negative_quantity("m/s")]`` takes ``0.1 m/s`` and holds ``0.1``. A default is a float in SI.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NoReturn

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import PydanticCustomError, core_schema

from estimfw.config.unit_examples import examples_of
from estimfw.errors import ConfigError
from estimfw.units import parse_quantity, parse_unit, si_name
from estimfw.units.quantity import NUMBER_PATTERN

__all__ = [
    "QuantityType",
    "QuantityVectorType",
    "non_negative_quantity",
    "non_negative_quantity_vector",
    "positive_quantity",
    "positive_quantity_vector",
    "quantity",
    "quantity_vector",
    "refuse",
]

Sign = Literal["any", "non-negative", "positive"]


def refuse(message: str, hint: str | None = None, at: int | str | tuple[int | str, ...] | None = None) -> NoReturn:
    """Raise, inside a pydantic validator, what ``validate`` turns into a ``ConfigError`` at its place (or deeper, ``at``)."""
    context: dict[str, Any] = {"message": message, "hint": hint or ""}
    if at is not None:
        context["at"] = at if isinstance(at, tuple) else (at,)
    raise PydanticCustomError("estimfw", "{message}", context)


@dataclass(frozen=True, slots=True)
class QuantityType:
    """One physical number.

    Attributes
    ----------
    unit : str
        Any unit of the right dimension; values arrive in SI.
    sign : 'any', 'non-negative' or 'positive'
    minimum, maximum : str or None
        Bounds as quantities (``-90 deg``), included.
    examples : tuple of str
        Shown in errors and editors; customary ones of the dimension if empty.
    """

    unit: str
    sign: Sign = "any"
    minimum: str | None = None
    maximum: str | None = None
    examples: tuple[str, ...] = field(default=())

    @property
    def shown(self) -> tuple[str, ...]:
        return self.examples or examples_of(self.unit)

    @property
    def hint(self) -> str:
        return f"expected a {self.adjective}quantity in {self.unit}, such as {' or '.join(self.shown)}"

    @property
    def adjective(self) -> str:
        return "" if self.sign == "any" else f"{self.sign} "

    @property
    def is_plain(self) -> bool:
        """Whether a number without a unit will do, because the unit is 1."""
        return parse_unit(self.unit).dimension.is_none

    def read(self, value: object) -> float:
        """The number in SI.

        Raises
        ------
        ConfigError
            With examples of right ones.
        """
        number = self._number(value)
        if (self.sign == "non-negative" and number < 0.0) or (self.sign == "positive" and number <= 0.0):
            raise ConfigError(
                f"{value!r} must be {'positive' if self.sign == 'positive' else 'zero or more'}", hint=self.hint
            )
        low = parse_quantity(self.minimum).value if self.minimum else number
        high = parse_quantity(self.maximum).value if self.maximum else number
        if not low <= number <= high:
            raise ConfigError(f"{value!r} is outside {self.minimum or ''}..{self.maximum or ''}", hint=self.hint)
        return number

    def _number(self, value: object) -> float:
        if self.is_plain and isinstance(value, (int, float)) and not isinstance(value, bool):
            return parse_quantity(repr(value)).value
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            raise ConfigError(f"{value!r} has no unit", hint=self.hint)
        if not isinstance(value, str):
            more = f"\n  write it by itself, as {self.shown[0]}, without a key" if isinstance(value, dict) else ""
            raise ConfigError(f"{_yaml_name(value)} is no quantity", hint=self.hint + more)
        try:
            found = parse_quantity(value)
        except ConfigError as cause:
            raise ConfigError(
                cause.message, hint=f"{cause.hint}\n  {self.hint}" if "no unit" in cause.message else self.hint
            ) from None
        if found.unit.dimension != parse_unit(self.unit).dimension:
            if found.unit.dimension.is_none and not found.unit.text:
                raise ConfigError(f"{value!r} has no unit", hint=self.hint)
            raise ConfigError(f"{value!r} is in {si_name(found.unit)}, not in {self.unit}", hint=self.hint)
        if self.is_plain and not found.unit.text:
            raise ConfigError(f"{value!r} is quoted", hint="write a plain number without quotes, or one in % or ppm")
        return found.value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return self.json_schema()

    def json_schema(self) -> JsonSchemaValue:
        """A string with a pattern; for a unit 1 a number will do as well."""
        text: JsonSchemaValue = {
            "type": "string",
            "pattern": rf"^\s*{NUMBER_PATTERN}\s*[^\s\d.].*$",
            "examples": list(self.shown),
            "description": f"{self.adjective}quantity in {self.unit}",
            "x-unit": self.unit,
        }
        if self.is_plain:
            return {"anyOf": [{"type": "number"}, text], "x-unit": self.unit}
        return text

    def _validate(self, value: object) -> float:
        try:
            return self.read(value)
        except ConfigError as cause:
            refuse(cause.message, cause.hint)


def _yaml_name(value: object) -> str:
    """What the writer of a config would call it."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    return "a list" if isinstance(value, (list, tuple)) else repr(value)


@dataclass(frozen=True, slots=True)
class QuantityVectorType:
    """``size`` physical numbers: a list of quantities, or one for all of them; arrives as a tuple of floats in SI."""

    each: QuantityType
    size: int

    def read(self, value: object) -> tuple[float, ...]:
        """The numbers in SI; raises what pydantic collects, with the index of the wrong one."""
        if not isinstance(value, (list, tuple)):
            return (self._one(value, None),) * self.size
        if len(value) != self.size:
            refuse(
                f"{len(value)} values where {self.size} are due",
                f"write {self.size} quantities in a list, or one for all",
            )
        return tuple(self._one(v, i) for i, v in enumerate(value))

    def _one(self, value: object, index: int | None) -> float:
        try:
            return self.each.read(value)
        except ConfigError as cause:
            refuse(cause.message, cause.hint, index)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        one = self.each.json_schema()
        many = {"type": "array", "items": one, "minItems": self.size, "maxItems": self.size}
        return {"anyOf": [one, many], "x-unit": self.each.unit}


def quantity(
    unit: str, *, minimum: str | None = None, maximum: str | None = None, examples: Sequence[str] = ()
) -> QuantityType:
    """Annotation of a float: ``Annotated[float, quantity("rad")]`` takes ``10 deg``.

    Parameters
    ----------
    unit : str
        Any unit of the dimension that is due.
    minimum, maximum : str, optional
        Bounds, included, as quantities.
    examples : sequence of str, optional
        Shown in errors and editors.
    """
    return QuantityType(unit, "any", minimum, maximum, tuple(examples))


def non_negative_quantity(unit: str, *, maximum: str | None = None, examples: Sequence[str] = ()) -> QuantityType:
    """As ``quantity``, zero or more: a sigma."""
    return QuantityType(unit, "non-negative", None, maximum, tuple(examples))


def positive_quantity(unit: str, *, maximum: str | None = None, examples: Sequence[str] = ()) -> QuantityType:
    """As ``quantity``, above zero: a duration, a correlation time."""
    return QuantityType(unit, "positive", None, maximum, tuple(examples))


def quantity_vector(unit: str, size: int, *, examples: Sequence[str] = ()) -> QuantityVectorType:
    """Annotation of a ``tuple[float, ...]``: ``[1 deg, 2 deg, 3 deg]``, or one quantity for all ``size`` of them."""
    return QuantityVectorType(quantity(unit, examples=examples), size)


def non_negative_quantity_vector(unit: str, size: int, *, examples: Sequence[str] = ()) -> QuantityVectorType:
    """As ``quantity_vector``, each zero or more."""
    return QuantityVectorType(non_negative_quantity(unit, examples=examples), size)


def positive_quantity_vector(unit: str, size: int, *, examples: Sequence[str] = ()) -> QuantityVectorType:
    """As ``quantity_vector``, each above zero."""
    return QuantityVectorType(positive_quantity(unit, examples=examples), size)
