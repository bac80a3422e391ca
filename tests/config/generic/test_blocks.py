"""The generic blocks by what their textbooks say: variances over time in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]
Composed = Callable[[str], Problem]
TIME = np.array([0.5, 2.0, 7.0, 30.0, 400.0])


def coasted(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance at TIME, from rows that hold nothing."""
    stream = Stream("z", TIME, np.full((TIME.size, 1), np.nan), ("z",))
    run = run_problem(problem, record=Record({"z": stream}, initial={"time": np.array(0.0)}))
    at = np.searchsorted(run.prepared.steps.time, TIME - 1e-9)
    assert len(run.covariance) == len(run.prepared.steps)
    return run.estimate[at], run.covariance[at]


def with_block(settings: str, more: str = "") -> str:
    return (
        f"estimfw: 1\nblocks: {{x: {{{settings}}}}}\n{more}"
        "measurements: {z: {kind: direct, of: [{block: x}], noise: 1 m}}\n"
    )


def test_a_random_constant_keeps_mean_and_sigma(composed: Composed) -> None:
    mean, P = coasted(composed(with_block("kind: random_constant, unit: m, sigma: 3 cm, mean: 2 m")))
    np.testing.assert_array_equal(mean[:, 0], 2.0)
    np.testing.assert_allclose(P[:, 0, 0], 0.03**2, rtol=1e-14)


def test_a_random_walk_grows_linearly_in_variance(composed: Composed) -> None:
    _, P = coasted(composed(with_block("kind: random_walk, unit: m, sigma: 1 m, noise: 0.2 m/sqrt(s)")))
    np.testing.assert_allclose(P[:, 0, 0], 1.0 + 0.04 * TIME, rtol=1e-12)


@pytest.mark.parametrize("start", [0.0, 0.5, 2.0, 6.0])
def test_a_gauss_markov_process_goes_to_its_steady_sigma(composed: Composed, start: float) -> None:
    settings = f"kind: gauss_markov, unit: m, sigma: {start} m, mean: 3 m, steady_sigma: 2 m, correlation_time: 5 s"
    mean, P = coasted(composed(with_block(settings)))
    np.testing.assert_allclose(mean[:, 0], 3.0 * np.exp(-TIME / 5.0), rtol=1e-11)
    forgotten = np.exp(-2.0 * TIME / 5.0)
    np.testing.assert_allclose(P[:, 0, 0], start**2 * forgotten + 4.0 * (1.0 - forgotten), rtol=1e-11)


def test_a_gauss_markov_process_that_starts_steady_stays_so(composed: Composed) -> None:
    settings = "kind: gauss_markov, unit: m, sigma: 2 m, steady_sigma: 2 m, correlation_time: 1 min"
    _, P = coasted(composed(with_block(settings)))
    np.testing.assert_allclose(P[:, 0, 0], 4.0, rtol=1e-12)


def test_an_integrated_random_walk_is_the_double_integral_of_white_noise(composed: Composed) -> None:
    settings = (
        "kind: integrated_random_walk, unit: m, sigma: 1 m, mean: 1 m, rate_sigma: 0.5 m/s, rate_mean: -2 m/s, "
        "noise: 0.3 m/s/sqrt(s)"
    )
    problem = composed(with_block(settings))
    assert problem.plan.states == ("x", "x_rate")
    mean, P = coasted(problem)
    np.testing.assert_allclose(mean[:, 0], 1.0 - 2.0 * TIME, rtol=1e-12)
    np.testing.assert_allclose(mean[:, 1], -2.0, rtol=1e-14)
    q = 0.09
    np.testing.assert_allclose(P[:, 0, 0], 1.0 + 0.25 * TIME**2 + q * TIME**3 / 3, rtol=1e-11)
    np.testing.assert_allclose(P[:, 0, 1], 0.25 * TIME + q * TIME**2 / 2, rtol=1e-11)
    np.testing.assert_allclose(P[:, 1, 1], 0.25 + q * TIME, rtol=1e-11)


def test_axes_have_their_own_figures(composed: Composed) -> None:
    text = (
        "estimfw: 1\nblocks:\n"
        "  x: {kind: random_walk, unit: m, axes: [a, b], sigma: [1 m, 20 cm], noise: [0 m/sqrt(s), 1 m/sqrt(s)]}\n"
        "measurements: {z: {kind: direct, of: [{block: x, axes: [b]}], rows: [z], noise: 1 m}}\n"
    )
    problem = composed(text)
    _, P = coasted(problem)
    assert problem.plan.states == ("x[a]", "x[b]")
    np.testing.assert_allclose(P[:, 0, 0], 1.0, rtol=1e-14)
    np.testing.assert_allclose(P[:, 1, 1], 0.04 + TIME, rtol=1e-12)
    np.testing.assert_array_equal(problem.plan.measurements[0].H.evaluate(np.zeros(0)), [[0.0, 1.0]])


def test_couple_and_schedule_move_a_block_as_their_integral_does(composed: Composed) -> None:
    steps = "[{time: 1 s, value: 3 N}, {time: 5 s, value: -1 N}]"
    more = (
        f"inputs: {{push: {{kind: schedule, unit: N, steps: {steps}}}}}\n"
        "process: {pushed: {kind: couple, target: x, source: push, coefficient: 0.5}}\n"
    )
    mean, _ = coasted(composed(with_block("kind: random_constant, unit: m, sigma: 1 m", more)))
    work = 3.0 * np.clip(TIME - 1.0, 0.0, 4.0) - np.clip(TIME - 5.0, 0.0, None)
    np.testing.assert_allclose(mean[:, 0], 0.5 * work, atol=1e-11)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ("kind: random_constant, unit: m, sigma: -1 m", "sigma is negative"),
        ("kind: random_walk, unit: m, sigma: 1 m, noise: -1 m/sqrt(s)", "noise is negative"),
        ("kind: random_walk, unit: m, sigma: 1 m, noise: 1 m/s", "'1 m/s' is in m/s"),
        ("kind: gauss_markov, unit: m, sigma: 1 m, steady_sigma: 1 m, correlation_time: 0 s", "must be positive"),
        (
            "kind: gauss_markov, unit: m, sigma: 1 m, steady_sigma: -1 m, correlation_time: 1 s",
            "steady_sigma is negative",
        ),
        ("kind: random_constant, unit: m, axes: [a, b], sigma: [1 m]", "1 values where 2 are due"),
        ("kind: random_constant, unit: m, sigma: 1 s", "'1 s' is in s, not in m"),
    ],
)
def test_figures_that_cannot_be_are_refused_at_their_place(composed: Composed, settings: str, text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        composed(with_block(settings))
    assert text in caught.value.message
    assert caught.value.location is not None and caught.value.location.line == 2


def test_a_frame_that_no_block_brings_is_refused(composed: Composed) -> None:
    with pytest.raises(
        ConfigError, match=r"blocks\.x\.frame: there is no frame 'b'\s+no block of this config brings a"
    ):
        composed(with_block("kind: random_constant, unit: m, sigma: 1 m, frame: b"))
