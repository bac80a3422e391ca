"""The provider is corrected in the frames of its slots, wherever the blocks live and whichever of them are there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.run.run import Collected, run_problem

Example = Callable[..., Problem]
KERNELS = ("numpy", "numba")
TURNED = (
    "initial_attitude={yaw: 30 deg, pitch: 10 deg, roll: 0 deg}", "source.duration=60 s", "source.rate=10 Hz",
)  # fmt: skip
IN_B = "{kind: express_in_frame, block: attitude_error, frame: b}"


def run(example: Example, kernel: str, *policies: str, estimator: str = "loop: closed") -> Collected:
    named = ", ".join(["sins_static.constant_specific_force", *policies])
    estimator = f"estimator={{kind: kalman, kernel: {kernel}, {estimator}}}"
    return run_problem(example("static_12", *TURNED, estimator, f"policies=[{named}]"))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("estimator", ["loop: closed", "restarts: [20 s, 40 s]"])
def test_a_block_in_another_frame_corrects_as_one_in_the_frame_of_its_slot(
    example: Example, kernel: str, estimator: str
) -> None:
    """One filter in other coordinates: equal up to the second order of the correction, 1 deg squared at its first steps."""
    at_home, turned = run(example, kernel, estimator=estimator), run(example, kernel, IN_B, estimator=estimator)
    assert turned.prepared.plan.states[3:6] == ("attitude_error[R]", "attitude_error[F]", "attitude_error[U]")
    assert np.max(np.abs(turned.output[-1] - at_home.output[-1]) / at_home.output_sigma[-1]) < 0.02
    np.testing.assert_allclose(turned.output_sigma[-1], at_home.output_sigma[-1], rtol=0.02)
    level = np.rad2deg(turned.output[-1, 1:3])
    assert level == pytest.approx([10.0, 0.0], abs=0.05)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_slot_without_a_block_is_left_alone(example: Example, kernel: str) -> None:
    """Nothing estimates the attitude: it stays where it started, and the velocity is corrected as ever."""
    done = run(example, kernel, "{kind: drop_states, states: [attitude_error, gyro_bias]}")
    free = run(example, kernel, "{kind: drop_states, states: [attitude_error, gyro_bias]}", estimator="loop: open")
    assert done.prepared.plan.correction.shape == (6, 6)
    np.testing.assert_allclose(done.output[:, :3], free.output[:, :3], atol=1e-8)


@pytest.mark.parametrize("estimator", ["loop: closed", "loop: closed, restarts: [20 s, 40 s]", "restarts: [20.05 s]"])
def test_both_kernels_correct_a_block_in_another_frame_alike(example: Example, estimator: str) -> None:
    numpy, numba = (run(example, kernel, IN_B, estimator=estimator) for kernel in KERNELS)
    assert np.max(np.abs(numpy.output - numba.output) / numpy.output_sigma) < 1e-9
    assert np.max(np.abs(numpy.estimate - numba.estimate) / numpy.sigma) < 1e-9
