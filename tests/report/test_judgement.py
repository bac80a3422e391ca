"""Verdicts on the filter's honesty agree with chi-square, and say which sigmas are wrong in which direction."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from estimfw.analysis.chi_square import quantile
from estimfw.report.judgement import nis_verdict, sigma_caveat
from estimfw.run.summary import MeasurementSummary


def measured(mean: float, *, fused: int = 500, freedom: float = 2.0) -> MeasurementSummary:
    counts = {"fused": fused, "gated": 0, "late": 0, "missing": 0, "invalid": 0}
    return MeasurementSummary("zero_velocity", "m/s", 2, counts, mean, freedom)


@given(st.lists(st.floats(0.5, 1e5), min_size=1, max_size=20), st.floats(1e-4, 1 - 1e-4))
def test_quantiles_are_those_of_scipy(freedom: list[float], probability: float) -> None:
    np.testing.assert_allclose(quantile(probability, freedom), chi2.ppf(probability, freedom), rtol=1e-9)


@pytest.mark.parametrize("freedom", [1.0, 2.0, 3.0])
def test_a_consistent_filter_is_called_so_99_times_in_100(freedom: float) -> None:
    means = np.random.default_rng(3).chisquare(500 * freedom, 2000) / 500
    tones = [nis_verdict(measured(float(mean), freedom=freedom)).tone for mean in means]
    assert 0.98 < tones.count("good") / 2000 < 0.998


def test_innovations_that_are_too_large_mean_sigmas_that_are_too_small() -> None:
    verdict = nis_verdict(measured(8.0))
    assert verdict.tone == "bad"
    assert "sigmas too small" in verdict.text
    assert "2 times as large" in verdict.sentence


def test_small_innovations_say_that_r_is_large_and_nothing_else() -> None:
    """The sigma of a level angle can be too small at the same time: biases do not show in the innovations."""
    verdict = nis_verdict(measured(0.0008))
    assert verdict.tone == ""
    assert verdict.text == "R larger than the innovations show"
    assert "50 times smaller" in verdict.sentence and "nothing of biases" in verdict.sentence


@pytest.mark.parametrize("one", [measured(2.0, fused=0), measured(math.nan), measured(math.nan, freedom=math.nan)])
def test_nothing_is_said_of_what_was_not_fused(one: MeasurementSummary) -> None:
    verdict = nis_verdict(one)
    assert (verdict.tone, verdict.sentence) == ("", "")


def with_policies(*policies: dict[str, object]) -> xr.Dataset:
    return xr.Dataset(attrs={"policies": json.dumps(policies)})


def test_exact_and_mirrored_reductions_need_no_caveat() -> None:
    assert sigma_caveat(xr.Dataset()) == ""
    assert sigma_caveat(with_policies({"label": "a", "kind": "exact"}, {"label": "b", "kind": "mirrored"})) == ""


def test_each_approximation_and_each_state_that_it_took_away_is_named_in_one_line() -> None:
    told = sigma_caveat(
        with_policies(
            {"label": "constant_f", "kind": "approximate", "removed_states": []},
            {"label": "coriolis", "kind": "mirrored", "removed_states": ["other"]},
            {"label": "prune", "kind": "approximate", "removed_states": ["accel_bias[E]", "gyro_bias[E]"]},
        )
    )
    assert told == (
        "The sigmas are the reduced filter's own: constant_f and prune approximate the model, and the removed states "
        "(accel_bias[E], gyro_bias[E]) are not in them."
    )


def test_where_honest_sigmas_are_known_the_line_says_what_they_are_of() -> None:
    known = xr.Dataset({"honest_sigma": ("time", [1.0])})
    exact = known.assign_attrs(policies=json.dumps([{"label": "quotient", "kind": "exact"}]))
    assert (
        sigma_caveat(exact)
        == "The reduction is exact: the honest sigmas, on the unreduced model, are the filter's own."
    )
    truth = {"removed_states": ["accel_bias[E]"], "unmodelled": ["transport_rate"]}
    rough = known.assign_attrs(
        policies=json.dumps([{"label": "prune", "kind": "approximate"}]), truth_model=json.dumps(truth)
    )
    told = sigma_caveat(rough)
    assert "(accel_bias[E]) live on" in told and "transport_rate" in told
