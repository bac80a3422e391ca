"""Units against pint, an independent library, and against the definitions themselves."""

from __future__ import annotations

import contextlib
import math
import time
from typing import Any

import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimfw.errors import ConfigError
from estimfw.units import display_unit, parse_quantity, parse_unit, si_name
from estimfw.units.table import SPELLED_OUT, UNITS

PINT: Any = pint.UnitRegistry()
#: Names that mean something else to pint, in its own words.
PINT_NAMES = {
    "ug": "(1e-6 * standard_gravity)", "mg": "(1e-3 * standard_gravity)", "g": "standard_gravity", "nmi": "nautical_mile",
    "kn": "knot", "deg": "degree", "arcmin": "arcminute", "arcsec": "arcsecond", "%": "percent", "K": "kelvin",
    "V": "volt", "mV": "millivolt", "A": "ampere", "mA": "milliampere", "min": "minute", "h": "hour", "ft": "foot",
    "Gal": "(0.01 * m/s**2)", "mGal": "(1e-5 * m/s**2)", "J": "joule", "N": "newton", "W": "watt", "Pa": "pascal",
}  # fmt: skip
PINT_BASES = {"kg": "[mass]", "m": "[length]", "A": "[current]", "K": "[temperature]", "s": "[time]"}


def assert_same(ours: str, theirs: Any) -> None:
    unit = parse_unit(ours)
    expected = theirs.to_base_units()
    assert float(unit.scale) == pytest.approx(expected.magnitude, rel=1e-13)
    dimension = {d: p for d, p in expected.dimensionality.items() if abs(p) > 1e-12}
    halves = dict(zip(("kg", "rad", "m", "A", "K", "s"), unit.dimension.halves, strict=True))
    assert {PINT_BASES[b]: h / 2 for b, h in halves.items() if h and b != "rad"} == pytest.approx(dimension)


@pytest.mark.parametrize("name", sorted(UNITS))
def test_every_unit_of_the_table_is_what_pint_says(name: str) -> None:
    assert_same(name, PINT.parse_expression(PINT_NAMES.get(name, name)) * PINT.dimensionless)


names = st.sampled_from(sorted(set(UNITS) - {"%"}))
factors = st.tuples(names, st.sampled_from([-2, -1, -0.5, 0.5, 1, 1.5, 2]))


@settings(max_examples=150, deadline=None)
@given(st.lists(factors, min_size=1, max_size=4))
def test_products_and_half_powers_agree_with_pint(parts: list[tuple[str, float]]) -> None:
    ours = "*".join(f"{name}^{power}" for name, power in parts)
    theirs = PINT.Quantity(1.0)
    for name, power in parts:
        theirs = (
            theirs * (PINT.parse_expression(PINT_NAMES.get(name, name)) * PINT.dimensionless).to_base_units() ** power
        )
    assert_same(ours, theirs)


@given(st.lists(factors, min_size=1, max_size=4))
def test_the_si_text_of_a_unit_reads_back_as_its_dimension(parts: list[tuple[str, float]]) -> None:
    unit = parse_unit("*".join(f"{name}^{power}" for name, power in parts))
    again = parse_unit(unit.si_text)
    assert again.dimension == unit.dimension
    assert float(again.scale) == 1.0


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e300, max_value=1e300))
def test_a_number_in_si_units_is_read_to_the_last_bit(number: float) -> None:
    assert parse_quantity(f"{number!r} m/s").value == number


def test_the_spellings_of_a_root_are_one_unit_and_the_root_is_never_dropped() -> None:
    spellings = [
        "deg/sqrt(h)",
        "deg/√h",
        "deg/h^0.5",
        "deg/h**0.5",
        "deg/h^(1/2)",
        "deg*h^-0.5",
        "°/√h",
        "deg/h½",
        "√(deg²/h)",
    ]
    units = [parse_unit(text) for text in spellings]
    assert all(unit == units[0] for unit in units)
    assert {parse_quantity(f"0.001 {text}").value for text in spellings} == {parse_quantity("0.001 deg/√h").value}
    assert parse_quantity("0.001 deg/√h").value == pytest.approx(0.001 * math.pi / 180 / 60, rel=1e-15)
    assert units[0] != parse_unit("deg/h")


def test_a_random_walk_is_the_density_of_its_rate() -> None:
    assert parse_unit("deg/s/sqrt(Hz)") == parse_unit("deg/sqrt(s)")
    assert parse_unit("ug/sqrt(Hz)").dimension == parse_unit("m/s/sqrt(h)").dimension


def test_ug_is_a_millionth_of_standard_gravity_and_no_mass() -> None:
    assert parse_quantity("100 ug").value == 9.80665e-4
    assert parse_quantity("100 µg") == parse_quantity("100 μg") == parse_quantity("100 ug")
    assert parse_quantity("100 ug").unit.si_text == "m/s^2"


def test_the_specified_sensor_numbers() -> None:
    """Numbers printed in the specification of the static alignment (g there is local: 9.80665 here)."""
    assert parse_quantity("0.001 deg/sqrt(h)").value == pytest.approx(2.9089e-7, rel=1e-5)
    assert parse_quantity("0.01 deg/h").value == pytest.approx(4.8481e-8, rel=1e-5)


def test_division_reads_from_left_to_right() -> None:
    assert parse_unit("m/s/s") == parse_unit("m/s^2") == parse_unit("m/(s*s)") == parse_unit("m*s⁻²")
    assert parse_unit("m/s*s") == parse_unit("m")


def test_blanks_around_number_and_operators_do_not_matter() -> None:
    assert parse_quantity("  0.1m / s ") == parse_quantity("0.1 m/s")
    assert parse_quantity("−5 deg").value == parse_quantity("-5 deg").value < 0.0


@pytest.mark.parametrize(
    "text",
    ["9**9**9 m", "9^9^9 m", "1 m**9**9", "1 m^99999999999", "1 m^(1/0)", "1 m^0.3", "1 √√h", "1 sqrt(sqrt(h))", "1 m^²",
     "1 ((((((((m))))))))", "1 " + "(" * 5000, "1 " + "m*" * 5000 + "m", "1 __import__", "1 m;s", "1 m s", "0x10 m",
     "1_000 m", "1,5 m", "m", "", "   ", "nan m", "inf m", "1e400 m", "1e308 km", "1e-400 m", "1e-999999999 m", "1e999999999 m",
     "12:30:45", "1 m/(s", "1 m)", "1 m//s", "1 m/", "1 *m", "1 2", "1 foo", "1 (((((%^30)^30)^30)^30)^30)", "1 um^30*um^30",
     "1 M", "1 gram", "1 ٣"],
)  # fmt: skip
def test_wrong_text_is_refused_at_once_with_examples(text: str) -> None:
    start = time.process_time()
    with pytest.raises(ConfigError) as caught:
        parse_quantity(text)
    assert time.process_time() - start < 0.1
    assert len(str(caught.value)) < 600


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused_and_nothing_else_happens(text: str) -> None:
    for candidate in (text, f"1 {text}"):
        with contextlib.suppress(ConfigError):
            assert math.isfinite(parse_quantity(candidate).value)


def test_a_misspelt_unit_names_the_nearest() -> None:
    with pytest.raises(ConfigError, match="did you mean 'arcsec'"):
        parse_quantity("3 arcsecs")


@pytest.mark.parametrize(
    ("si", "quantity", "shown"),
    [("rad", "attitude_error", "deg"), ("rad/s", "gyro_bias", "deg/h"), ("m/s^2", "accel_bias", "ug"), ("m/s", "", "m/s"),
     ("m/s**2", "specific_force", "m/s**2"), ("rad/sqrt(s)", "", "deg/sqrt(h)"), ("rad", "latitude_error", "arcsec"),
     ("1", "", "1")],
)  # fmt: skip
def test_a_display_unit_scales_back_to_si(si: str, quantity: str, shown: str) -> None:
    unit = display_unit(si, quantity)
    assert unit.text == shown
    assert unit.scale * parse_quantity(f"1 {shown}").value == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "meant"), [("deg/sec", "s"), ("1/Hours", "h"), ("meters/s", "m"), ("degrees/hr", "deg"), ("volts", "V")]
)
def test_a_spelled_out_name_is_told_its_short_one(text: str, meant: str) -> None:
    with pytest.raises(ConfigError, match=rf"write '{meant}'"):
        parse_unit(text)


def test_spelled_out_names_mean_what_pint_says() -> None:
    own = {"deg": "degree", "h": "hour", "min": "minute", "kn": "knot", "ft": "foot"}
    odd = {"rads", "kt", "kts", "hz", "mins", "degs", "hrs", "amps"}  # not, or otherwise, known to pint
    for word, name in SPELLED_OUT.items():
        assert word not in UNITS
        if word not in odd:
            assert PINT.parse_units(word) == PINT.parse_units(own.get(name, PINT_NAMES.get(name, name))), word


@pytest.mark.parametrize(("text", "name"), [("mV", "V"), ("hPa", "Pa"), ("W", "W"), ("kn", "m/s"), ("1/s", "1/s")])
def test_a_unit_is_told_by_the_name_of_its_si_unit(text: str, name: str) -> None:
    assert si_name(parse_unit(text)) == name
