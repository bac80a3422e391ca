"""Units of quotients, short and readable."""

from __future__ import annotations

from fractions import Fraction

import pytest

from estimfw.units.ratio import unit_ratio
from estimfw.units.unit_text import parse_unit

CASES = [
    ("rad/s", "rad", "1/s"),
    ("m/s^2", "rad", "m/rad/s^2"),
    ("m", "m", "1"),
    ("m", "1", "m"),
    ("1", "s", "1/s"),
    ("V", "K", "V/K"),
    ("W", "J", "1/s"),
    ("V", "m/s", "(V)/(m/s)"),
    ("J", "m", "N"),
    ("m/s^1.5", "m", "1/s^1.5"),
]


@pytest.mark.parametrize(("unit", "over", "text"), CASES)
def test_a_quotient_is_written_shortly_and_reads_back(unit: str, over: str, text: str) -> None:
    assert unit_ratio(unit, over) == text
    ratio = parse_unit(text)
    assert ratio.dimension == parse_unit(unit).dimension * parse_unit(over).dimension.power(Fraction(-1))
    assert float(ratio.scale) == 1.0
