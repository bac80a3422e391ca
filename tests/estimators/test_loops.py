"""Open loop, closed loop and staged restarts: where theory says that they are one filter, they are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.run.run import Collected, run_problem

Example = Callable[..., Problem]
DEGREE = np.pi / 180


def final(example: Example, loop: str, tilt: float, *more: str) -> Collected:
    # The reference is the exact velocity, so that only the error of linearisation, quadratic in the tilt, separates the loops.
    return run_problem(
        example(
            "static_12", f"source.misalignment=[{tilt} deg, {tilt} deg, {tilt} deg]", "source.noise=false",
            "source.duration=100 s", "source.gyro_bias=[0 deg/h, 0 deg/h, 0 deg/h]", "source.accel_bias=[0 ug, 0 ug, 0 ug]",
            "policies=[]", f"estimator={{kind: kalman, loop: {loop}}}", *more,
        )
    )  # fmt: skip


def test_open_and_closed_loop_differ_by_the_square_of_the_tilt(example: Example) -> None:
    differences = []
    for tilt in (0.002, 0.02):
        one, other = final(example, "open", tilt), final(example, "closed", tilt)
        differences.append(float(np.max(np.abs(one.output[-1] - other.output[-1]))))
        # Open loop, the tilt turns some gravity into F, where it meets the heading's uncertainty.
        np.testing.assert_allclose(one.sigma[-1], other.sigma[-1], rtol=5 * tilt)
    assert differences[0] < 0.1 * (0.002 * DEGREE)
    assert 50 < differences[1] / differences[0] < 200


def test_a_closed_loop_leaves_nothing_but_the_last_innovation_in_what_it_corrects(example: Example) -> None:
    one, other = final(example, "open", 1.0), final(example, "closed", 1.0)
    assert np.all(np.abs(one.estimate[-1, 3:6]) > 0.9 * DEGREE)
    assert np.all(np.abs(other.estimate[-1, 3:6]) < 0.01 * other.sigma[-1, 3:6])
    assert np.max(np.abs(other.output[-1, :3])) < 0.1 * DEGREE


def test_a_restart_corrects_the_nominal_and_begins_again_from_the_prior(example: Example) -> None:
    run = final(example, "open", 5.0, "estimator.restarts=[60 s]", "source.rate=1 Hz")
    at = int(np.flatnonzero(run.prepared.steps.restart)[0])
    assert run.prepared.steps.time[at] == pytest.approx(61.0)
    before, after = run.estimate[at - 1, 3:6], run.estimate[at, 3:6]
    assert np.all(np.abs(before) > 2.5 * DEGREE)
    assert np.all(np.abs(after[:2]) < 1.0 * DEGREE)
    # Sigmas of the biases are the prior's again, and the attitude of the nominal is the corrected one.
    np.testing.assert_allclose(run.sigma[at, 9:], run.sigma[0, 9:], rtol=1e-3)
    assert np.max(np.abs(run.output[at - 1, :3] - run.output[at, :3])) < 1.0 * DEGREE


def test_a_restart_without_a_nominal_to_correct_is_a_fresh_filter(example: Example) -> None:
    problem = example("tracker", "source.duration=20 s", "estimator={kind: kalman, restarts: [10 s]}")
    run = run_problem(problem)
    at = int(np.flatnonzero(run.prepared.steps.restart)[0])
    time = run.prepared.steps.time
    fresh = run_problem(example("tracker", "source.duration=20 s", "estimator={kind: kalman}"))
    assert time[at - 1] == pytest.approx(10.0)
    # Step for step what a filter does that begins at 10 s with the rows after it.
    np.testing.assert_allclose(run.sigma[at:], fresh.sigma[: len(time) - at], rtol=1e-9)
    assert np.max(np.abs(run.estimate[at] - run.estimate[at - 1])) > 1.0
