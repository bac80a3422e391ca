"""The unit in which people read a quantity."""

from __future__ import annotations

from dataclasses import dataclass

from estimfw.units.table import NAMED_SI
from estimfw.units.unit import Unit
from estimfw.units.unit_text import parse_unit

__all__ = ["DisplayUnit", "display_unit", "si_name"]


@dataclass(frozen=True, slots=True)
class DisplayUnit:
    """A unit for people.

    Attributes
    ----------
    text : str
        Such as ``deg/h``.
    scale : float
        Display number = scale * SI number.
    """

    text: str
    scale: float


#: What an SI unit is shown in, if the name of the quantity holds one of the words ("" fits any); first match wins.
_CHOICES: tuple[tuple[str, tuple[str, ...], str], ...] = (
    ("rad", ("latitude", "longitude"), "arcsec"),
    ("rad", ("",), "deg"),
    ("rad/s", ("bias", "drift", ""), "deg/h"),
    ("rad/s^2", ("",), "deg/h/s"),
    ("rad/sqrt(s)", ("",), "deg/sqrt(h)"),
    ("m/s^2", ("bias", "drift"), "ug"),
    ("m/s^1.5", ("accel",), "ug/sqrt(Hz)"),
)


def display_unit(si_unit: str, quantity: str = "") -> DisplayUnit:
    """The unit in which a quantity is shown; the SI unit itself where no other is customary.

    Parameters
    ----------
    si_unit : str
        Such as ``rad/s``, in any spelling that ``parse_unit`` reads.
    quantity : str, optional
        What it is: ``accel_bias`` (m/s^2) is shown in ``ug``, ``specific_force`` in ``m/s^2``.

    Raises
    ------
    ConfigError
        Where ``si_unit`` is no unit.
    """
    unit = parse_unit(si_unit)
    for si, words, shown in _CHOICES:
        if unit.dimension == parse_unit(si).dimension and any(word in quantity for word in words):
            return DisplayUnit(shown, float(unit.scale) / float(parse_unit(shown).scale))
    return DisplayUnit(si_unit, 1.0)


def si_name(unit: Unit) -> str:
    """The SI unit of its dimension, by its own name where it has one: ``V`` for ``mV``, ``m/s`` for ``kn``."""
    return NAMED_SI.get(unit.dimension, unit.si_text)
