"""Judges of a run's health: what a loop over the epochs says, however the run is cut into stretches."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import chi2

from estimfw.analysis.health import NisJudge, NisLimit, RejectionJudge, RejectionLimit
from estimfw.kernels.fuse import FUSED, GATED, INVALID, MISSING

CODES = st.lists(st.sampled_from([FUSED, GATED, GATED, MISSING, INVALID, -1]), max_size=60)
CUTS = st.lists(st.integers(0, 60), max_size=5)
FloatArray = NDArray[np.float64]


def pieces(count: int, cuts: list[int]) -> list[slice]:
    edges = sorted({0, count, *(c for c in cuts if c < count)})
    return [slice(a, b) for a, b in pairwise(edges)]


@given(CODES, CUTS, st.integers(1, 6), st.floats(0.0, 5.0))
@settings(deadline=None)
def test_rejections_in_a_row_are_counted_as_by_hand(
    codes: list[int], cuts: list[int], times: int, longer: float
) -> None:
    time = np.asarray(0.5 * np.arange(len(codes)) + 3.0, dtype=float)
    expected, row = [], list[float]()
    for t, code in zip(time.tolist(), codes, strict=True):
        row = row if code not in (FUSED, GATED) else [*row, t] if code == GATED else []
        expected.append(code == GATED and len(row) >= times and row[-1] - row[0] >= longer - 1e-9)
    judge, found = RejectionJudge(RejectionLimit(times, longer)), list[bool]()
    for own in pieces(len(codes), cuts):
        judge, degraded, _ = judge.advance(time[own], np.array(codes[own], dtype=np.int64))
        found += degraded.tolist()
    assert found == expected
    assert judge.count == len(row)
    assert not row or judge.since == row[0]


@given(
    st.lists(st.one_of(st.floats(0.0, 40.0), st.just(math.nan)), max_size=60),
    CUTS,
    st.integers(2, 8),
    st.floats(0.0, 4.0),
)
@settings(deadline=None)
def test_the_mean_nis_of_the_last_epochs_is_judged_as_by_hand(
    values: list[float], cuts: list[int], epochs: int, longer: float
) -> None:
    gate = np.array([0.0, 10.83, 13.82])
    time = np.asarray(0.5 * np.arange(len(values)), dtype=float)
    freedom = np.array([0 if math.isnan(v) else 1 + k % 2 for k, v in enumerate(values)], dtype=np.int64)
    expected, window, since, good = [], list[tuple[float, int]](), math.nan, math.nan
    for t, value, degrees in zip(time.tolist(), values, freedom.tolist(), strict=True):
        if math.isnan(value):
            expected.append(False)
            continue
        window = [*window, (min(value, gate[degrees]), degrees)][-epochs:]
        total, all_degrees = sum(v for v, _ in window), sum(d for _, d in window)
        out = len(window) == epochs and total > chi2.ppf(0.99, all_degrees)
        since = (t if math.isnan(since) else since) if out else math.nan
        low = len(window) == epochs and total < chi2.ppf(0.01, all_degrees)
        good = t if len(window) == epochs and not out and not low else good
        expected.append(out and t - since >= longer - 1e-9)
    judge, found = NisJudge(NisLimit(epochs, 0.99, longer), gate), list[bool]()
    for own in pieces(len(values), cuts):
        judge, judged = judge.advance(time[own], np.array(values[own], dtype=float), freedom[own])
        found += judged.high.tolist()
    assert found == expected
    assert judge.good == good or (math.isnan(judge.good) and math.isnan(good))


def test_a_right_filter_is_hardly_ever_told_to_diverge_and_one_with_half_the_sigmas_always_is() -> None:
    """10^5 epochs at the defaults; their windows overlap, so 10^-6 an epoch is a bound from above."""
    nis: FloatArray = np.random.default_rng(1).chisquare(2, 100_000)
    time = np.arange(nis.size, dtype=float)
    freedom = np.full(nis.size, 2, dtype=np.int64)
    for gate in (None, np.array([0.0, 10.83, 13.82])):
        judge = NisJudge(NisLimit(50, 0.999999), gate)
        assert judge.advance(time, nis, freedom)[1].high.sum() <= 1
        assert judge.advance(time, nis, freedom)[1].low.sum() <= 1
        assert judge.advance(time, 4.0 * nis, freedom)[1].high[49:].mean() > 0.99


def test_the_ratio_is_that_of_the_mean_to_its_expectation() -> None:
    nis = np.array([2.0, 4.0, 6.0, 8.0])
    _, judged = NisJudge(NisLimit(2, 0.9)).advance(np.arange(4.0), nis, np.full(4, 2, dtype=np.int64))
    assert judged.ratio.tolist() == pytest.approx([1.0, 1.5, 2.5, 3.5])
