"""A filter that believes what is true passes; one whose R or Q is wrong by four does not."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

Runs = Callable[..., xr.Dataset]


def verdicts(dataset: xr.Dataset) -> dict[tuple[str, str], Any]:
    return {(e["figure"], e["quantity"]): e for e in json.loads(dataset.attrs["judged"])}


@pytest.mark.parametrize("seed", [1, 2])
def test_a_consistent_filter_passes(tracked: Callable[..., Any], judged_runs: Runs, seed: int) -> None:
    found = verdicts(judged_runs(tracked(), 100, seed))
    assert ("NEES", "all states") in found and ("NIS", "fix") in found
    assert [name for name, entry in found.items() if not entry["consistent"]] == []


@pytest.mark.parametrize(
    ("wrong", "quantity", "word"),
    [
        # A noise twice as large is a variance four times as large.
        ("measurements.fix.noise=6 m", ("NIS", "fix"), "sigmas too large"),
        ("measurements.fix.noise=1.5 m", ("NEES", "position"), "sigmas too small"),
        ("blocks.velocity.noise=0.6 m/s/sqrt(s)", ("NEES", "velocity"), "sigmas too large"),
        ("blocks.velocity.noise=0.15 m/s/sqrt(s)", ("NEES", "velocity"), "sigmas too small"),
        ("blocks.velocity.noise=0.15 m/s/sqrt(s)", ("NIS", "speed"), "sigmas too small"),
    ],
)
def test_a_noise_that_is_wrong_by_four_is_seen(
    tracked: Callable[..., Any], judged_runs: Runs, wrong: str, quantity: tuple[str, str], word: str
) -> None:
    entry = verdicts(judged_runs(tracked(wrong), 50))[quantity]
    assert not entry["consistent"]
    assert entry["verdict"].startswith(word)


def test_bias_and_spread_are_those_of_the_runs(tracked: Callable[..., Any], judged_runs: Runs) -> None:
    dataset = judged_runs(tracked(), 40)
    error, sigma = dataset["end_error"].to_numpy(), dataset["end_sigma"].to_numpy()
    np.testing.assert_allclose(dataset["bias"].to_numpy()[-1], error.mean(axis=0), rtol=1e-9)
    np.testing.assert_allclose(dataset["spread"].to_numpy()[-1], error.std(axis=0, ddof=1), rtol=1e-9)
    np.testing.assert_allclose(dataset["ratio"].to_numpy()[-1] ** 2, np.mean(error**2, 0) / np.mean(sigma**2, 0))
    # One state: its NEES is the square of error over sigma.
    single = dataset["end_nees"].sel(quantity=list(dataset["state"].to_numpy()))
    np.testing.assert_allclose(single.to_numpy(), (error / sigma) ** 2, rtol=1e-9)


def test_only_the_raw_sigmas_of_a_reduced_filter_are_not_checked(
    tracked: Callable[..., Any], judged_runs: Runs
) -> None:
    entries = verdicts(judged_runs(tracked(), 10)).values()
    assert all(entry["checked"] for entry in entries)
