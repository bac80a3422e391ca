"""The predicted gain of several processors: its limit, and where it begins."""

from __future__ import annotations

from fractions import Fraction

import pytest

from estimfw.analysis.dense_cost import CutSizes
from estimfw.analysis.speed_up import (
    Link,
    break_even_latency,
    break_even_states,
    equal_cut,
    largest_speed_up,
    speed_up,
)

FREE = Link(0.0, 0.0, 1e-9)
NETWORK = Link(50e-6, 64e-9, 1e-9)
TEN = CutSizes.local((5, 5), (1, 1))


def test_ten_states_save_948_products_for_89_words_and_three_synchronisations() -> None:
    # The specification of the gravimeter's alignment, section 3: "89 words and 3 synchronisations to save 950 multiplications".
    times = speed_up(TEN, Link(1.0, 1.0, 1.0))
    assert (times.one - times.busiest, times.words, times.waiting) == (948.0, 89.0, 3.0)


@pytest.mark.parametrize(("parts", "limit"), [(2, 1.71), (4, 3.69)])
def test_the_gain_goes_to_its_limit(parts: int, limit: float) -> None:
    assert largest_speed_up(parts) == pytest.approx(limit, abs=0.005)
    for share in (Fraction(1, 10_000), Fraction(1, 10), Fraction(1, 2)):
        found = speed_up(equal_cut(1_000_000, parts, share), FREE).ratio
        assert found == pytest.approx(largest_speed_up(parts, float(share)), rel=1e-4)


def test_at_the_break_even_latency_nothing_is_gained() -> None:
    fast = Link(0.0, 1e-10, 1e-9)
    latency = break_even_latency(TEN, fast)
    assert speed_up(TEN, Link(latency, 1e-10, 1e-9)).ratio == pytest.approx(1.0)
    assert speed_up(TEN, Link(latency / 2, 1e-10, 1e-9)).ratio > 1.0
    assert break_even_latency(TEN, NETWORK) < 0.0  # 89 words take 5.7 us, 948 products 0.95 us


def test_gain_begins_where_it_is_said_to() -> None:
    states = break_even_states(5, Fraction(1, 10), NETWORK)
    assert states is not None
    for more in range(20):
        assert speed_up(equal_cut(states + more, 5, Fraction(1, 10)), NETWORK).ratio > 1.0
    for fewer in range(1, 20):
        assert speed_up(equal_cut(states - fewer, 5, Fraction(1, 10)), NETWORK).ratio <= 1.0


def test_a_link_that_is_hopeless_is_told_to_be() -> None:
    assert break_even_states(2, Fraction(1, 5), Link(1e9, 0.0, 1e-9)) is None
    assert break_even_states(2, Fraction(1, 5), FREE) == 2
