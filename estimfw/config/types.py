"""The pydantic types of config files: strict settings, quantities with units, noise levels.

In a config a physical number is text with a unit (``0.01 deg/h``) and arrives as a float in SI. Plain numbers stay
plain (a gate, a count); a quoted number, ``true``, ``.nan`` or an infinity is refused where a
number is due. The makers are used as annotations::

    class Velocity(Settings):
        sigma: Annotated[float, non_negative_quantity("m/s")]
        noise: Annotated[NoiseLevel, noise("m/s", 3)]
        bias: Annotated[tuple[float, ...], quantity_vector("rad/s", 3)] = (0.0, 0.0, 0.0)

A default is given in SI. Every type has a JSON Schema with a pattern and examples, for editors.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AllowInfNan, BaseModel, ConfigDict, Field, Strict, StringConstraints

from estimfw.config.noise_level import NoiseLevel, noise
from estimfw.config.quantity_types import (
    non_negative_quantity,
    non_negative_quantity_vector,
    positive_quantity,
    positive_quantity_vector,
    quantity,
    quantity_vector,
)

__all__ = [
    "Identifier",
    "Names",
    "NoiseLevel",
    "NonNegative",
    "Number",
    "Positive",
    "PositiveInt",
    "Settings",
    "Site",
    "noise",
    "non_negative_quantity",
    "non_negative_quantity_vector",
    "positive_quantity",
    "positive_quantity_vector",
    "quantity",
    "quantity_vector",
]


class Settings(BaseModel):
    """Base of all config models: strict, frozen, no unknown keys, finite floats (an int is one); use tuples for lists."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)


#: A finite plain number.
Number = Annotated[float, Strict(), AllowInfNan(False)]
#: A finite plain number > 0.
Positive = Annotated[float, Strict(), AllowInfNan(False), Field(gt=0)]
#: A finite plain number >= 0.
NonNegative = Annotated[float, Strict(), AllowInfNan(False), Field(ge=0)]
#: A count, at least 1.
PositiveInt = Annotated[int, Strict(), Field(ge=1)]
#: A list of names (a tuple; YAML has lists).
Names = Annotated[tuple[str, ...], Strict(False)]
#: The name of a block, a term, a measurement.
Identifier = Annotated[str, StringConstraints(strict=True, pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=64)]


class Site(Settings):
    """A place on the Earth: geodetic latitude and longitude (rad), height above the ellipsoid (m)."""

    latitude: Annotated[
        float,
        quantity("rad", minimum="-90 deg", maximum="90 deg", examples=("34 deg", "-12.5 deg")),
        Field(description="geodetic, positive north"),
    ]
    longitude: Annotated[
        float,
        quantity("rad", minimum="-180 deg", maximum="360 deg", examples=("75 deg", "-75 deg")),
        Field(description="positive east"),
    ] = 0.0
    height: Annotated[float, quantity("m"), Field(description="above the ellipsoid")] = 0.0
