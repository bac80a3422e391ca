"""The judging rule: how often it fails consistent filters, and whether it sees one that is wrong."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from estimfw.analysis.chi_square import mean_bounds
from estimfw.analysis.consistency import at_one_instant, effective_samples, level_of_each, over_time, share_outside

FloatArray = NDArray[np.float64]


def correlated_squares(rng: np.random.Generator, runs: int, instants: int, freedom: int, memory: float) -> FloatArray:
    """NEES (runs, instants) of stationary Gauss-Markov errors of unit variance, with a memory of so many instants."""
    keep = np.exp(-1.0 / memory)
    x = np.empty((instants, runs, freedom))
    x[0] = rng.standard_normal((runs, freedom))
    for k in range(1, instants):
        x[k] = keep * x[k - 1] + np.sqrt(1.0 - keep**2) * rng.standard_normal((runs, freedom))
    return np.asarray(np.sum(x**2, axis=2).T)


def test_bounds_are_those_of_chi_square() -> None:
    low, high = mean_bounds(0.95, [300.0])[0]
    assert (low, high) == pytest.approx(tuple(np.asarray(stats.chi2.ppf([0.025, 0.975], 300.0)) / 300.0), rel=1e-12)
    assert np.all(np.isnan(mean_bounds(0.95, [0.0])))


def test_independent_numbers_are_their_own_effective_samples() -> None:
    values = np.random.default_rng(2).chisquare(3, 200_000)
    assert effective_samples(values, 3.0) == pytest.approx(200_000, rel=0.02)
    # A mean of 10 of them is worth 10, and a factor changes nothing.
    assert effective_samples(7.0 * values.reshape(-1, 10).mean(axis=1), 3.0) == pytest.approx(200_000, rel=0.05)


@pytest.mark.parametrize(("runs", "memory"), [(20, 50.0), (100, 50.0), (100, 1e6), (100, 0.1)])
def test_a_consistent_filter_fails_as_often_as_it_is_allowed_to(runs: int, memory: float) -> None:
    rng, trials, level = np.random.default_rng(3), 800, 0.95
    failed = 0
    for _ in range(trials):
        squares = correlated_squares(rng, runs, 60, 3, memory)
        failed += not over_time(squares.mean(axis=1), 3.0, level).inside
    # Binomial: 40 of 800 are expected, sd 6.2; the effective sample size is an approximation for few runs.
    assert 18 <= failed <= 75, failed


def test_correlated_instants_would_fail_a_rule_that_counts_them_as_independent() -> None:
    rng, failed = np.random.default_rng(4), 0
    for _ in range(100):
        mean = correlated_squares(rng, 100, 60, 3, 1e6).mean()
        low, high = 3.0 * mean_bounds(0.95, [100.0 * 60.0 * 3.0])[0]
        failed += not low <= mean <= high
    assert failed > 50


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_a_covariance_wrong_by_four_is_seen_with_few_runs(factor: float) -> None:
    squares = factor * correlated_squares(np.random.default_rng(5), 50, 60, 3, 1e6)
    judged = over_time(squares.mean(axis=1), 3.0, level_of_each(0.95, 40))
    assert not judged.inside
    assert judged.verdict.endswith("too small" if factor > 1.0 else "too large")
    assert not at_one_instant(squares[:, -1], 3.0, level_of_each(0.95, 40)).inside


def test_all_tests_together_keep_the_confidence() -> None:
    assert level_of_each(0.95, 1) == 0.95
    assert level_of_each(0.95, 20) ** 20 == pytest.approx(0.95)
    rng, trials = np.random.default_rng(6), 400
    level = level_of_each(0.95, 20)
    failed = sum(
        not all(at_one_instant(rng.chisquare(2, 100), 2.0, level).inside for _ in range(20)) for _ in range(trials)
    )
    assert stats.binom.cdf(failed, trials, 0.05) > 1e-3
    assert stats.binom.sf(failed - 1, trials, 0.05) > 1e-3


def test_share_of_instants_outside_leaves_out_what_is_not_known() -> None:
    mean = np.array([0.5, 1.0, np.nan, 2.0])
    assert share_outside(mean, np.full(4, 0.8), np.full(4, 1.5)) == pytest.approx(2.0 / 3.0)
