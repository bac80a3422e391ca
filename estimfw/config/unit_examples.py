"""Examples of right quantities, by dimension."""

from __future__ import annotations

from estimfw.units import parse_unit, si_name

__all__ = ["examples_of"]

_EXAMPLES: dict[str, tuple[str, ...]] = {
    "m": ("100 m", "1.5 km"),
    "m/s": ("0.1 m/s", "2 km/h", "5 kn"),
    "m/s^2": ("100 ug", "0.001 m/s^2"),
    "m/s/sqrt(s)": ("10 ug/sqrt(Hz)", "0.01 m/s/sqrt(h)"),
    "s": ("600 s", "10 min"),
    "Hz": ("1 Hz", "100 Hz"),
    "rad": ("10 deg", "5 arcmin"),
    "rad/s": ("0.01 deg/h", "1 deg/s"),
    "rad/sqrt(s)": ("0.001 deg/sqrt(h)", "0.01 deg/h/sqrt(Hz)"),
    "rad/s/sqrt(s)": ("0.001 deg/h/sqrt(h)",),
    "K": ("293 K",),
    "K/s": ("0.1 K/s",),
    "W": ("40 W",),
    "V": ("10 mV", "3.7 V"),
    "A": ("1.5 A", "20 mA"),
    "m/sqrt(Hz)": ("0.01 m/sqrt(Hz)",),
    "m/s/sqrt(Hz)": ("0.1 m/s/sqrt(Hz)",),
    "1": ("0.01", "5 ppm", "1 %"),
}
_BY_DIMENSION = {parse_unit(unit).dimension: shown for unit, shown in _EXAMPLES.items()}


def examples_of(unit: str) -> tuple[str, ...]:
    """Two or three customary quantities of the dimension of ``unit``."""
    found = parse_unit(unit)
    plain = unit if "(" not in unit.replace("sqrt(", "") else si_name(found)
    return _BY_DIMENSION.get(found.dimension, (f"0.1 {plain}",))
