"""Numbers keep the digits that their sigma leaves of them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimfw.report.numbers import UNKNOWN, count, instant, plain, plus_minus, significant


@pytest.mark.parametrize(
    ("value", "sigma", "expected"),
    [
        (179.98234, 0.0613, ("179.982", "0.061")),
        (0.0430, 0.0132, ("0.043", "0.013")),
        (-12.3456, 9.99, ("-12", "10")),
        (12345.6, 234.0, ("12346", "234")),
        (1.0, 0.099999, ("1.00", "0.10")),
        (1.23456789, math.nan, ("1.23457", UNKNOWN)),
        (1.23456789, 0.0, ("1.23457", "0.0")),
        (math.nan, 0.1, (UNKNOWN, "0.10")),
        (2.5e-8, 1.23e-9, ("2.500e-08", "1.2e-09")),
        (math.nan, math.nan, (UNKNOWN, UNKNOWN)),
    ],
)
def test_two_digits_of_sigma(value: float, sigma: float, expected: tuple[str, str]) -> None:
    assert plus_minus(value, sigma) == expected


@given(st.floats(-1e6, 1e6), st.floats(1e-4, 1e6))
def test_what_is_shown_is_within_a_tenth_of_sigma(value: float, sigma: float) -> None:
    shown, spread = plus_minus(value, sigma)
    assert abs(float(shown) - value) <= 0.051 * sigma + 0.5 * (sigma >= 10)
    assert float(spread) == pytest.approx(sigma, rel=0.051)


@given(st.floats(-1e300, 1e300), st.integers(1, 9))
def test_significant_digits_are_enough(value: float, digits: int) -> None:
    assert float(significant(value, digits)) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits), abs=1e-320)


def test_small_words() -> None:
    assert plain(600.0) == "600"
    assert plain(math.inf) == UNKNOWN
    assert count(1234567) == "1\u2009234\u2009567"


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        (14400.0, "14\u2009400"),
        (604799.995, "604\u2009799.995"),
        (0.2, "0.2"),
        (-0.5, "-0.5"),
        (600.0, "600"),
        (7.2e-16, "0"),
        (-1e-9, "0"),
        (1.7e9, "1\u2009700\u2009000\u2009000"),
        (math.nan, UNKNOWN),
    ],
)
def test_an_instant_is_whole_however_late(time: float, expected: str) -> None:
    assert instant(time) == expected
