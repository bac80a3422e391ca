"""Models that are none (17 to 22): exit code 3 with the worst of it, or a warning in state names."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

Check = Callable[..., Any]
Tracker = Callable[..., str]


@pytest.mark.parametrize(
    ("sigma", "says"),
    [
        ("-50 m", "filter.yaml:4:67: blocks.position.sigma: sigma is negative: '-50 m'"),
        ("[50 m, -50 m]", "filter.yaml:4:74: blocks.position.sigma[1]: sigma is negative: '-50 m'"),
    ],
    ids=["17-one", "17-of-a-list"],
)
def test_17_a_negative_sigma_is_refused(check: Check, tracker: Tracker, sigma: str, says: str) -> None:
    told = check(tracker("sigma: 50 m", f"sigma: {sigma}"))
    assert told.code == 3
    told.says(says)


def test_17_a_negative_noise_of_a_measurement_is_refused(check: Check, tracker: Tracker) -> None:
    told = check(tracker("noise: 3 m", "noise: -3 m"))
    assert told.code == 3
    told.says("filter.yaml:9:55: measurements.fix.noise: noise is negative: '-3 m'")


def test_17_a_prior_that_is_not_positive_semidefinite_tells_its_worst_eigenvalue(
    check: Check, tracker: Tracker
) -> None:
    pairs = {
        ("position[x]", "position[y]"): 0.9,
        ("position[x]", "velocity[x]"): 0.9,
        ("position[y]", "velocity[x]"): -0.9,
    }
    entries = ", ".join(f"{{between: ['{a}', '{b}'], value: {value}}}" for (a, b), value in pairs.items())
    told = check(tracker("estimator:", f"prior: {{correlations: [{entries}]}}\nestimator:"))
    assert told.code == 3
    # The correlation matrix 1, 0.9, 0.9; 0.9, 1, -0.9; 0.9, -0.9, 1 has the eigenvalues 1.9, 1.9 and 1 - 2 * 0.9.
    told.says("filter.yaml:10:8: the prior covariance is not positive semidefinite: worst eigenvalue -0.8")


def test_17_a_correlation_beyond_one_or_of_an_unknown_state_is_refused(check: Check, tracker: Tracker) -> None:
    prior = "prior: {correlations: [{between: ['position[x]', 'position[y]'], value: 1.5}]}\nestimator:"
    told = check(tracker("estimator:", prior))
    assert told.code == 3
    told.says("filter.yaml:10:73: prior.correlations[0].value: 1.5")
    told = check(tracker("estimator:", prior.replace("position[y]", "position[z]").replace("1.5", "0.5")))
    assert told.code == 3
    told.says(
        "filter.yaml:10:50: prior.correlations[0].between: there is no state 'position[z]'",
        "did you mean 'position[y]'",
    )


@pytest.mark.parametrize(
    ("matrix", "says"),
    [
        ("[[1, 0.5], [0.4, 1]]", "the correlation is not symmetric: x and y differ by 0.1"),
        ("[[1, 1.5], [1.5, 1]]", "the correlation is not positive semidefinite: worst eigenvalue -0.5"),
        ("[[2, 0], [0, 1]]", "a diagonal that is not 1 everywhere"),
        ("[[1]]", "1 x 1 where 2 x 2 is due"),
        ("[[1, 0]]", "no square matrix"),
    ],
    ids=["17-R-not-symmetric", "17-R-not-psd", "17-R-diagonal", "17-R-too-small", "17-R-not-square"],
)
def test_17_the_correlation_of_a_noise_must_be_one(check: Check, tracker: Tracker, matrix: str, says: str) -> None:
    told = check(tracker("noise: 3 m}", f"noise: 3 m, correlation: {matrix}}}"))
    assert told.code == 3
    told.says("filter.yaml:9:73: measurements.fix.correlation: ", says)


@pytest.mark.parametrize("noise", ["0 m", "[3 m, 0 m]"], ids=["18-all", "18-one-row"])
def test_18_zero_noise_must_be_called_perfect(check: Check, tracker: Tracker, noise: str) -> None:
    told = check(tracker("noise: 3 m", f"noise: {noise}"))
    assert told.code == 3
    told.says("filter.yaml:9:55: measurement 'fix' has zero noise (R = 0)", "perfect: true")
    assert check(tracker("noise: 3 m", f"noise: {noise}, perfect: true")).code == 0


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("duration: 10 s", "duration: 0 s", "filter.yaml:11:42: source.duration: '0 s' must be positive"),
        ("rate: 2 Hz", "rate: -2 Hz", "source.rate: '-2 Hz' must be positive"),
        (
            "kind: random_walk, unit: m/s, axes: [x, y], sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)",
            "kind: gauss_markov, unit: m/s, axes: [x, y], sigma: 5 m/s, steady_sigma: 5 m/s, correlation_time: 0 s",
            "blocks.velocity.correlation_time: correlation_time must be positive: '0 s'",
        ),
    ],
    ids=["19-duration", "19-rate", "19-correlation-time"],
)
def test_19_times_of_zero_or_less_are_refused(check: Check, tracker: Tracker, old: str, new: str, says: str) -> None:
    told = check(tracker(old, new))
    assert told.code == 3
    told.says(says)


MANY = ", ".join(f"s{i}" for i in range(30_000))


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("duration: 10 s", "duration: 1e12 s", ("11:9: 2e+12 steps of 4 states need about", "a shorter `duration`")),
        ("rate: 2 Hz", "rate: 1e13 Hz", ("11:9: 1e+14 steps of 4 states need about", "GiB of memory")),
        (
            "axes: [x, y], sigma: 50 m",
            f"axes: [{MANY}], sigma: 50 m",
            ("blocks.position.axes: 30000 states need about 335 GiB",),
        ),
    ],
    ids=["20-duration", "20-rate", "20-states"],
)
def test_20_what_no_memory_holds_is_refused_with_the_estimate(
    check: Check, tracker: Tracker, monkeypatch: pytest.MonkeyPatch, old: str, new: str, parts: tuple[str, ...]
) -> None:
    monkeypatch.setattr("estimfw.data.memory.available_bytes", lambda: 8.0 * 2**30)
    told = check(tracker(old, new))
    assert told.code == 3
    told.says(*parts, "8 GiB may be used")


def test_20_an_imu_simulated_for_too_long_is_refused_before_it_is_drawn(check: Check, standing: str) -> None:
    source = "source: {kind: sins_static.simulate, duration: 1e9 s, rate: 1000 Hz}\n"
    told = check(standing[: standing.index("source:")] + source)
    assert told.code == 3
    told.says("1e+12 samples of an IMU need about 8.94e+05 GiB")


def test_21_a_label_twice_is_refused(check: Check, tracker: Tracker) -> None:
    told = check(tracker("axes: [x, y], sigma: 50 m", "axes: [x, x], sigma: 50 m"))
    assert told.code == 3
    told.says("filter.yaml:4:56: blocks.position.axes[1]: 'x' stands twice")
    rate = "kind: integrated_random_walk, rate_sigma: 1 m/s, noise: 1 m/s/sqrt(s)"
    told = check(
        tracker(
            "kind: random_constant", rate, "velocity:", "position_rate:", "source: velocity", "source: position_rate"
        )
    )
    assert told.code == 3
    told.says("2 times a block, noise or input 'position_rate'")


def test_22_what_is_not_determined_is_a_warning_in_state_names(check: Check, tracker: Tracker) -> None:
    config = tracker(
        "fix: {kind: direct, of: [{block: position}], noise: 3 m}",
        "speed: {kind: direct, of: [{block: velocity}], noise: 1 m/s}",
    )
    told = check(config)
    assert told.code == 0
    assert "warning: 2 combinations of states are not determined by the measurements" in told.err
    assert "position[x]" in told.err
    assert "position[y]" in told.err
    assert "velocity" not in told.err
    done = check(config, "--json", command="run")
    assert done.code == 0
    assert "2 combinations of states are not determined by the measurements" in done.err
    answer = json.loads(done.out)
    assert answer["undetermined"] == ["position[x] 50 m", "position[y] 50 m"]
    assert answer["states"]["position[x]"]["sigma"] >= 50.0


def test_22_a_combination_is_told_with_its_factors(check: Check, tracker: Tracker) -> None:
    """Only x + 2 y is measured: nobody sees x move by 50 m while y moves by -25 m."""
    terms = "of: [{block: position, coefficient: [[1, 2]]}], rows: [sum], noise: 3 m"
    told = check(tracker("of: [{block: position}], noise: 3 m", terms))
    assert told.code == 0
    told.says("position[x] 50 m, position[y] -25 m")
