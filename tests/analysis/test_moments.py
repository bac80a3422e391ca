"""Moments from parts are those of the whole."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from estimfw.analysis.moments import Moments


@given(st.integers(0, 1000), st.lists(st.integers(1, 9), min_size=1, max_size=5), st.floats(-1e6, 1e6))
def test_merged_parts_have_the_moments_of_all_runs(seed: int, sizes: list[int], offset: float) -> None:
    values = np.random.default_rng(seed).standard_normal((sum(sizes), 3)) + offset
    parts = np.split(values, np.cumsum(sizes)[:-1])
    merged = Moments.merge(Moments.of(part) for part in parts)
    assert merged.count == sum(sizes)
    np.testing.assert_allclose(merged.mean, values.mean(axis=0), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(merged.rms, np.sqrt(np.mean(values**2, axis=0)), rtol=1e-9)
    if merged.count > 1:
        np.testing.assert_allclose(merged.spread, values.std(axis=0, ddof=1), rtol=1e-6, atol=1e-9)


def test_a_large_offset_does_not_eat_the_spread() -> None:
    # A sum of squares minus the square of the sum would leave nothing of it.
    values = 1e8 + np.random.default_rng(1).standard_normal((1000, 1))
    merged = Moments.merge(Moments.of(part) for part in np.split(values, 10))
    np.testing.assert_allclose(merged.spread, values.std(axis=0, ddof=1), rtol=1e-6)
