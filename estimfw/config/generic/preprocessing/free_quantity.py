"""A quantity whose dimension says what it is about: ``0.04 m`` a pulse, ``10 deg/s`` at most."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

from estimfw.config.quantity_types import refuse
from estimfw.errors import ConfigError
from estimfw.units import Quantity, parse_quantity, parse_unit, si_name
from estimfw.units.quantity import NUMBER_PATTERN

__all__ = ["FreeQuantity", "times_second"]


@dataclass(frozen=True, slots=True)
class FreeQuantity:
    """Annotation of a `Quantity`: text with any unit, or a plain number, above zero (or of any sign but zero)."""

    examples: tuple[str, ...]
    signed: bool = False

    def read(self, value: object) -> Quantity:
        """Raises what pydantic collects."""
        hint = f"such as {' or '.join(self.examples)}"
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            refuse(f"{value!r} is no quantity", hint)
        try:
            found = parse_quantity(value if isinstance(value, str) else repr(value))
        except ConfigError as error:
            refuse(error.message, hint)
        if isinstance(value, str) and not found.unit.text:
            refuse(f"{value!r} has no unit", hint)
        if found.value == 0.0 or (found.value < 0.0 and not self.signed):
            refuse(f"{value!r} must {'not be zero' if self.signed else 'be positive'}", hint)
        return found

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        text = {"type": "string", "pattern": rf"^\s*{NUMBER_PATTERN}\s*[^\s\d.].*$", "examples": list(self.examples)}
        return {"anyOf": [{"type": "number"}, text]}


def times_second(unit: str, power: int) -> str:
    """The SI unit of something times s to a power: ``m/s`` and 1 make ``m``."""
    if not unit or not power:
        return unit
    return si_name(parse_unit(f"({unit})*s" if power > 0 else f"({unit})/s"))
