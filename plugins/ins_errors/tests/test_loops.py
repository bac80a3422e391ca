"""Open and closed loop: the same to first order in the errors of the INS, and which of them to trust where these are large."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Run = Callable[..., Any]
COMPLETE = ("process.local_level.terms=complete", "source.duration=1 h", "source.noise=false", "estimator.kernel=numba")


def small(scale: float, loop: str) -> tuple[str, ...]:
    """An INS whose errors are so many times those of the canonical one; the filter's prior stays."""
    errors = (
        f"{{attitude: [{2 * scale} arcmin, {2 * scale} arcmin, {6 * scale} arcmin], gyro_bias: {0.1 * scale} deg/h, "
        f"accel_bias: {100 * scale} ug}}"
    )
    return (*COMPLETE, f"source.errors={errors}", f"estimator.loop={loop}")


def apart(run: Run, scale: float) -> FloatArray:
    """Largest difference between open and closed loop, in sigmas: heading, velocity, latitude, then drifts and biases (9,).

    Drifts and biases are not corrected, so that they can be compared as they stand.
    """
    open_loop, closed = (run("ins_const11_heading", *small(scale, loop)).run for loop in ("open", "closed"))
    corrected = np.abs(open_loop.output - closed.output) / open_loop.output_sigma
    estimated = np.abs(open_loop.estimate - closed.estimate)[:, 6:] / open_loop.sigma[:, 6:]
    return np.asarray(np.max(np.concatenate([corrected, estimated], axis=1), axis=0))


def test_the_loops_differ_by_the_square_of_the_errors(done: Run) -> None:
    """A tenth of the errors, a hundredth of the difference: to first order the estimates are the same."""
    large, little = apart(done, 0.3), apart(done, 0.03)
    np.testing.assert_allclose(large / little, 100.0, rtol=0.35)
    assert np.all(little < 3e-4), little


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_a_closed_loop_keeps_the_estimated_errors_of_the_ins_at_zero(done: Run, kernel: str) -> None:
    found = done("ins_const11", "source.duration=600 s", f"estimator.kernel={kernel}").run
    assert np.max(np.abs(found.estimate[:, :6]) / found.sigma[:, :6]) < 3.0
    other = done("ins_const11", "source.duration=600 s", "estimator.kernel=numpy").run
    np.testing.assert_allclose(found.estimate, other.estimate, rtol=0, atol=1e-9)


def test_where_the_ins_is_off_by_metres_a_second_the_open_loop_of_equation_1_believes_too_much(done: Run) -> None:
    """Its velocity error stands in the coefficients: motion that is none tells azimuth and drift apart.

    The frozen sigma is 6.02 arcmin. The closed loop has it, and so has an open one with all terms: their forces are those that
    the INS felt.
    """
    sigma = {
        (loop, terms): done(
            "ins_const11",
            "source.noise=false",
            "estimator.kernel=numba",
            f"estimator.loop={loop}",
            f"process.local_level.terms={terms}",
        ).sigma(14400.0)[2]
        for loop in ("open", "closed")
        for terms in ("paper", "complete")
    }
    assert sigma["closed", "paper"] == pytest.approx(6.021, abs=2e-3)
    assert sigma["closed", "complete"] == pytest.approx(6.021, abs=2e-3)
    assert sigma["open", "complete"] == pytest.approx(6.021, abs=1e-2)
    assert sigma["open", "paper"] < 5.3
