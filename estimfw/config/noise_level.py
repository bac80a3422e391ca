"""The noise of a measurement: a sigma for each measurement, or a density."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

from estimfw.config.quantity_types import QuantityType, non_negative_quantity, refuse
from estimfw.errors import ConfigError
from estimfw.units import parse_quantity, parse_unit

__all__ = ["NoiseLevel", "NoiseType", "noise"]

NoiseKind = Literal["per_measurement", "density"]


#: The unit of examples where people do not write the SI one.
_CUSTOMARY = {parse_unit("rad").dimension: "deg", parse_unit("rad/s").dimension: "deg/s"}


@dataclass(frozen=True, slots=True)
class NoiseLevel:
    """How strong the white noise of a measurement is.

    Attributes
    ----------
    value : float or tuple of float
        Standard deviation in SI units, of all rows or of each. Per measurement in the unit of the measurement; as a
        density in unit/sqrt(Hz), so that R = value**2 / dt where one measurement is the mean over dt.
    kind : 'per_measurement' or 'density'
    """

    value: float | tuple[float, ...]
    kind: NoiseKind

    @property
    def values(self) -> tuple[float, ...]:
        return self.value if isinstance(self.value, tuple) else (self.value,)

    @property
    def has_zero(self) -> bool:
        """Whether a row is said to be perfect."""
        return any(v == 0.0 for v in self.values)


@dataclass(frozen=True, slots=True)
class NoiseType:
    """Reads ``0.1 m/s`` or ``0.1 m/s/sqrt(Hz)``, once or as a list of ``size``."""

    unit: str
    size: int | None = None

    def read(self, value: object) -> NoiseLevel:
        """The level; raises what pydantic collects."""
        if not isinstance(value, (list, tuple)):
            number, kind = self._one(value, None)
            return NoiseLevel(number, kind)
        if not value or (self.size is not None and len(value) != self.size):
            refuse(f"{len(value)} noises where {self.size or 'some'} are due", "write one for each row, or one for all")
        levels = [self._one(v, i) for i, v in enumerate(value)]
        if len({kind for _, kind in levels}) > 1:
            refuse("a noise per measurement and a density in one list", "give all of them in one way")
        return NoiseLevel(tuple(number for number, _ in levels), levels[0][1])

    @property
    def _per_measurement(self) -> QuantityType:
        shown = _CUSTOMARY.get(parse_unit(self.unit).dimension, self.unit)
        return non_negative_quantity(self.unit, examples=(f"0.1 {shown}", f"0.1 {shown}/sqrt(Hz)"))

    @property
    def _density_unit(self) -> str:
        return f"{self.unit}/sqrt(Hz)"

    def _one(self, value: object, index: int | None) -> tuple[float, NoiseKind]:
        try:
            if self._is_density(value):
                return non_negative_quantity(self._density_unit, examples=self._per_measurement.examples).read(
                    value
                ), "density"
            return self._per_measurement.read(value), "per_measurement"
        except ConfigError as cause:
            refuse(cause.message, cause.hint, index)

    def _is_density(self, value: object) -> bool:
        if not isinstance(value, str):
            return False
        try:
            dimension = parse_quantity(value).unit.dimension
        except ConfigError:
            return False
        return dimension == (parse_unit(self.unit) * parse_unit("s").power(Fraction(1, 2))).dimension

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        one = self._per_measurement.json_schema()
        one["description"] = f"sigma per measurement in {self.unit}, or a density in {self.unit}/sqrt(Hz)"
        many: dict[str, Any] = {"type": "array", "items": one, "minItems": self.size or 1}
        if self.size is not None:
            many["maxItems"] = self.size
        return {"anyOf": [one, many]}


def noise(unit: str, size: int | None = None) -> NoiseType:
    """Annotation of a ``NoiseLevel``: ``Annotated[NoiseLevel, noise("m/s", 3)]``.

    Parameters
    ----------
    unit : str
        Of the measurement.
    size : int, optional
        Rows of the measurement; a list must have as many.
    """
    return NoiseType(unit, size)
