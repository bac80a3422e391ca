"""Every unit that has a name."""

from __future__ import annotations

from fractions import Fraction

from estimfw.units.unit import BASES, Dimension, Scale, Unit

__all__ = ["ALIASES", "NAMED_SI", "SPELLED_OUT", "STANDARD_GRAVITY", "UNITS"]

#: m/s^2, exact (CGPM 1901).
STANDARD_GRAVITY = Fraction("9.80665")


def _unit(name: str, factor: Fraction | int | str, *, pi: int = 0, **exponents: int) -> Unit:
    dimension = Dimension(tuple(2 * exponents.get(base, 0) for base in BASES))
    return Unit(Scale.of(Fraction(factor), pi=pi), dimension, name)


_ALL = (
    _unit("m", 1, m=1),
    _unit("km", 1000, m=1),
    _unit("cm", "0.01", m=1),
    _unit("mm", "0.001", m=1),
    _unit("um", "1e-6", m=1),
    _unit("ft", "0.3048", m=1),
    _unit("nmi", 1852, m=1),
    _unit("s", 1, s=1),
    _unit("ms", "0.001", s=1),
    _unit("us", "1e-6", s=1),
    _unit("ns", "1e-9", s=1),
    _unit("min", 60, s=1),
    _unit("h", 3600, s=1),
    _unit("day", 86400, s=1),
    _unit("Hz", 1, s=-1),
    _unit("kHz", 1000, s=-1),
    _unit("MHz", 1000000, s=-1),
    _unit("kn", Fraction(1852, 3600), m=1, s=-1),
    _unit("g", STANDARD_GRAVITY, m=1, s=-2),
    _unit("mg", STANDARD_GRAVITY / 10**3, m=1, s=-2),
    _unit("ug", STANDARD_GRAVITY / 10**6, m=1, s=-2),
    _unit("Gal", "0.01", m=1, s=-2),
    _unit("mGal", "1e-5", m=1, s=-2),
    _unit("rad", 1, rad=1),
    _unit("mrad", "0.001", rad=1),
    _unit("urad", "1e-6", rad=1),
    _unit("deg", Fraction(1, 180), pi=1, rad=1),
    _unit("arcmin", Fraction(1, 180 * 60), pi=1, rad=1),
    _unit("arcsec", Fraction(1, 180 * 3600), pi=1, rad=1),
    _unit("K", 1, K=1),
    _unit("A", 1, A=1),
    _unit("mA", "0.001", A=1),
    _unit("V", 1, kg=1, m=2, s=-3, A=-1),
    _unit("mV", "0.001", kg=1, m=2, s=-3, A=-1),
    _unit("kg", 1, kg=1),
    _unit("N", 1, kg=1, m=1, s=-2),
    _unit("J", 1, kg=1, m=2, s=-2),
    _unit("W", 1, kg=1, m=2, s=-3),
    _unit("Pa", 1, kg=1, m=-1, s=-2),
    _unit("hPa", 100, kg=1, m=-1, s=-2),
    _unit("kPa", 1000, kg=1, m=-1, s=-2),
    _unit("%", "0.01"),
    _unit("ppm", "1e-6"),
)

#: By name.
UNITS: dict[str, Unit] = {unit.text: unit for unit in _ALL}

#: Other spellings of a name.
ALIASES: dict[str, str] = {"°": "deg", "µg": "ug", "μg": "ug", "µm": "um", "μm": "um", "µs": "us", "μs": "us"}

#: Words that people write for a name; they are not taken, but told.
SPELLED_OUT: dict[str, str] = {
    "sec": "s", "second": "s", "seconds": "s", "minute": "min", "minutes": "min", "mins": "min",
    "hr": "h", "hrs": "h", "hour": "h", "hours": "h", "days": "day", "degree": "deg", "degrees": "deg", "degs": "deg",
    "radian": "rad", "radians": "rad", "rads": "rad", "meter": "m", "meters": "m", "metre": "m", "metres": "m",
    "feet": "ft", "knot": "kn", "knots": "kn", "kt": "kn", "kts": "kn", "hertz": "Hz", "hz": "Hz", "volt": "V", "volts": "V",
    "ampere": "A", "amp": "A", "amps": "A", "watt": "W", "watts": "W", "kelvin": "K", "percent": "%",
}  # fmt: skip

#: Coherent SI units that have a name of their own, by dimension.
NAMED_SI: dict[Dimension, str] = {UNITS[name].dimension: name for name in ("N", "J", "W", "Pa", "V")}
