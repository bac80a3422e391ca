"""A decimated curve has the outline of the whole one."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from estimfw.report.decimate import kept_rows

columns = arrays(
    np.float64,
    array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=4).map(lambda shape: (shape[0] * 60, shape[1])),
    elements=st.floats(-1e300, 1e300) | st.just(float("nan")) | st.just(float("inf")),
    fill=st.nothing(),
)


@given(columns, st.integers(11, 200))
def test_extremes_ends_and_order_survive_within_the_limit(values: np.ndarray, limit: int) -> None:
    kept = kept_rows(values, limit)
    assert len(kept) <= limit
    assert kept[0] == 0
    assert kept[-1] == len(values) - 1
    assert np.all(np.diff(kept) > 0)
    for column in values.T:
        known = column[np.isfinite(column)]
        shown = column[kept][np.isfinite(column[kept])]
        if known.size:
            assert shown.min() == known.min()
            assert shown.max() == known.max()


@given(columns)
def test_a_short_curve_is_left_alone(values: np.ndarray) -> None:
    np.testing.assert_array_equal(kept_rows(values, len(values)), np.arange(len(values)))


def test_the_outline_holds_in_every_stretch_not_only_over_all() -> None:
    values = np.random.default_rng(0).standard_normal((100_000, 2))
    kept = kept_rows(values, 2000)
    for start in range(0, 100_000, 5000):
        inside = kept[(kept >= start) & (kept < start + 5000)]
        stretch = values[start : start + 5000]
        assert np.all(np.abs(values[inside].max(axis=0) - stretch.max(axis=0)) < 0.6)
        assert np.all(np.abs(values[inside].min(axis=0) - stretch.min(axis=0)) < 0.6)


def test_a_single_spike_and_a_short_gap_in_a_million_rows_are_seen() -> None:
    values = np.zeros((1_000_000, 1))
    values[654_321] = 1
    values[123_456:123_460] = np.nan
    kept = kept_rows(values, 1000)
    assert len(kept) <= 1000
    assert 654_321 in kept
    assert np.isnan(values[kept]).any()


def test_a_curve_of_nothing_but_gaps_stays_one() -> None:
    values = np.full((5000, 3), np.nan)
    kept = kept_rows(values, 100)
    assert 0 < len(kept) <= 100


def test_an_empty_curve_is_empty() -> None:
    assert kept_rows(np.empty((0, 2)), 100).size == 0
