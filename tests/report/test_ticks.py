"""Tick labels: read back they are the ticks, and they differ where the ticks do."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.ticker import MaxNLocator

from estimfw.report.ticks import LinearLabels, LogLabels, log_locator, power_of_ten

NORMAL = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")


def read_back(label: str) -> float:
    digits, dot, power = label.translate(NORMAL).partition("·10")
    if not dot and label.translate(NORMAL).lstrip("-").startswith("10") and any(c in label for c in "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"):
        sign, digits, power = label.startswith("−"), "1", label.translate(NORMAL).lstrip("-")[2:]
        return (-1 if sign else 1) * 10.0 ** int(power)
    return float(digits) * 10.0 ** int(power or 0)


@given(st.floats(-1e7, 1e7), st.floats(1e-6, 1e9))
def test_labels_of_the_ticks_of_any_range_are_distinct_and_right(low: float, span: float) -> None:
    ticks = MaxNLocator(nbins=6).tick_values(low, low + span)
    labels = LinearLabels().format_ticks(list(ticks))
    step = np.diff(ticks).min()
    if step > 1e-9 * np.abs(ticks).max():
        assert len(set(labels)) == len(ticks)
        np.testing.assert_allclose([read_back(label) for label in labels], ticks, atol=0.011 * step, rtol=1e-6)


@pytest.mark.parametrize(
    ("values", "labels"),
    [
        ([0.0, 0.01, 0.02], ["0.00", "0.01", "0.02"]),
        ([-0.5, 0.0, 0.5], ["−0.5", "0.0", "0.5"]),
        ([0.0, 2e-8], ["0", "2·10⁻⁸"]),
        ([0.0, 100.0, 200.0], ["0", "100", "200"]),
        ([-1e9, 0.0, 2.5e9], ["−10⁹", "0", "2.5·10⁹"]),
        ([], []),
    ],
)
def test_as_many_decimals_as_the_spacing_needs(values: list[float], labels: list[str]) -> None:
    assert LinearLabels().format_ticks(values) == labels


def test_logarithmic_labels_are_plain_near_one() -> None:
    assert [LogLabels()(value) for value in (0.001, 0.02, 1, 500, 1e5, 1e-5, 2e-7)] == [
        "0.001", "0.02", "1", "500", "10⁵", "10⁻⁵", "2·10⁻⁷",
    ]  # fmt: skip
    assert LinearLabels()(0.25) == "0.25"
    assert power_of_ten(-1000.0) == "−10³"


@given(st.floats(1e-12, 1e6), st.floats(1.1, 1e12))
def test_a_logarithmic_axis_has_a_handful_of_ticks(low: float, ratio: float) -> None:
    locator = log_locator(float(np.log10(ratio)))
    locator.create_dummy_axis()
    ticks = np.asarray(locator.tick_values(low, low * ratio))
    inside = ticks[(ticks >= low * 0.999) & (ticks <= low * ratio * 1.001)]
    assert 1 <= inside.size <= 9
