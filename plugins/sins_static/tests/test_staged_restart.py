"""A restart corrects the mechanization and begins anew, so the linearisation is made about a better attitude."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FAST = "estimator.kernel=numba"
ONCE, TWICE = "estimator.restarts=[120 s]", "estimator.restarts=[120 s, 240 s]"
#: Means of 200 noisy runs with 7 states, by the specification: heading, pitch, roll in deg.
MEANS = [
    (5.0, ONCE, (0.0422, 0.0064, -0.0048)),
    (10.0, ONCE, (0.0476, 0.0159, 0.0030)),
    (10.0, TWICE, (0.0422, 0.0057, -0.0054)),
]


@pytest.mark.parametrize(("angle", "restarts", "mean"), MEANS)
def test_restart_takes_the_linearisation_error_out(
    angle: float, restarts: str, mean: tuple[float, float, float], end_error: Callable[..., FloatArray],
    misaligned: Callable[..., str],
) -> None:  # fmt: skip
    error = end_error("static_7", misaligned(angle), "source.noise=false", restarts, FAST)
    assert np.all(np.abs(error - mean) < (0.005, 0.0005, 0.0005)), error


@pytest.mark.parametrize("states", [10, 12])
def test_restart_serves_all_three_filters_alike(
    states: int, end_error: Callable[..., FloatArray], misaligned: Callable[..., str]
) -> None:
    settings = (misaligned(10.0), "source.noise=false", FAST)
    seven = end_error("static_7", *settings, TWICE)
    assert np.all(np.abs(end_error(f"static_{states}", *settings, TWICE) - seven) < 5e-4)


def test_restart_brings_the_heading_from_a_degree_to_the_limit_of_the_biases(
    end_error: Callable[..., FloatArray], misaligned: Callable[..., str]
) -> None:
    limit = end_error("static_7", misaligned(1e-4), "source.noise=false", FAST)[0]
    without = end_error("static_7", misaligned(10.0), "source.noise=false", FAST)[0] - limit
    once = end_error("static_7", misaligned(10.0), "source.noise=false", ONCE, FAST)[0] - limit
    assert abs(abs(without) - 1.12) < 0.005
    assert abs(once) < 0.006


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_restart_corrects_the_mechanization_and_begins_from_the_prior(
    kernel: str, ran: Callable[..., Any], misaligned: Callable[..., str]
) -> None:
    done = ran("static_7", misaligned(5.0), "source.noise=false", ONCE, f"estimator.kernel={kernel}")
    restart = int(np.flatnonzero(done.prepared.steps.restart)[0])
    assert done.prepared.steps.time[restart - 1] == pytest.approx(120.0)
    first = done.prepared.plan.states.index("attitude_error[E]")
    tilt = np.degrees(done.truth[:, first : first + 3])
    before, after = np.linalg.norm(tilt[restart - 1]), np.linalg.norm(tilt[restart])
    assert abs(before - np.sqrt(3.0) * 5.0) < 0.1  # uncorrected until then: gyro biases add 0.01 deg/h
    assert after < 0.1 * before
    np.testing.assert_allclose(done.sigma[restart, first + 2], np.radians(10.0), rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "restarts", "mean"), MEANS)
def test_mean_of_200_noisy_runs_with_restarts(
    angle: float, restarts: str, mean: tuple[float, float, float], end_error: Callable[..., FloatArray],
    misaligned: Callable[..., str],
) -> None:  # fmt: skip
    errors = np.array(
        [end_error("static_7", misaligned(angle), f"source.seed={s}", restarts, FAST) for s in range(1, 201)]
    )
    assert np.all(np.abs(errors.mean(axis=0) - mean) < (0.005, 0.0005, 0.0005))
    # The later start has less time: 0.0134 deg of heading after one restart, 0.0162 after two.
    assert abs(errors[:, 0].std(ddof=1) / (0.0134 if restarts == ONCE else 0.0162) - 1.0) < 0.25
