"""The paper's simulated experiment (Zhu and Zhang, Table 2): 7, 10 and 12 states at 1, 5 and 10 deg of misalignment.

Order everywhere: heading (counter-clockwise, the program's yaw), pitch, roll, in deg.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FAST = "estimator.kernel=numba"
CASES = [(states, angle) for states in (7, 10, 12) for angle in (1.0, 5.0, 10.0)]

#: Table 2 minus an alignment with the clean settings (noise-free), as the specification prints it. The 12 states at
#: 10 deg are left out: there the paper's value hangs on choices that nobody wrote down.
PAPER_MINUS_CLEAN = {
    (7, 1.0): (0.0107, -0.0006, -0.0023),
    (7, 5.0): (0.0301, 0.0001, -0.0040),
    (7, 10.0): (0.0554, 0.0028, -0.0080),
    (10, 1.0): (0.0121, -0.0005, -0.0007),
    (10, 5.0): (0.0325, 0.0004, -0.0023),
    (10, 10.0): (0.0608, 0.0028, -0.0062),
    (12, 1.0): (0.0121, -0.0005, -0.0007),
    (12, 5.0): (0.0190, -0.0017, -0.0021),
}


@pytest.mark.parametrize(("states", "angle"), CASES)
def test_every_epoch_equals_an_independent_implementation(
    states: int, angle: float, ran: Callable[..., Any], naive: Callable[..., Any], misaligned: Callable[..., str]
) -> None:
    # Required: heading 0.002 (12 states 0.003), pitch 0.001, roll 0.002. What is left here is the half step of the
    # velocity, C (dv + dtheta x dv / 2) against C exp(dtheta / 2) dv: w_N w_U dt^2 / 8 = 1.8e-8 deg of tilt, and the
    # heading while it is still unknown, 1e-7 deg.
    done = ran(f"static_{states}", misaligned(angle), "source.noise=false")
    error = np.degrees(done.output_error[:, :3])
    np.testing.assert_allclose(error, naive(states, (angle,) * 3).error, rtol=0.0, atol=2e-7)


@pytest.mark.parametrize("states", [7, 10, 12])
def test_noisy_record_gives_what_an_independent_implementation_makes_of_the_same_increments(
    states: int, ran: Callable[..., Any], naive: Callable[..., Any], misaligned: Callable[..., str]
) -> None:
    done = ran(f"static_{states}", misaligned(5.0), "source.seed=3")
    increments = done.prepared.record.streams["imu"].values
    gravity = float(done.prepared.problem.reference["gravity"])  # 9.796184 is rounded, and V_U sums that up
    reference = naive(states, (5.0,) * 3, increments=increments, gravity=gravity)
    np.testing.assert_allclose(np.degrees(done.output_error[:, :3]), reference.error, rtol=0.0, atol=2e-7)
    scale = done.sigma[-1]
    np.testing.assert_allclose(done.estimate[-1] / scale, reference.estimate[-1] / scale, rtol=1e-7, atol=1e-5)


@pytest.mark.parametrize(("states", "angle"), PAPER_MINUS_CLEAN)
def test_table_2_within_its_tolerances(
    states: int, angle: float, end_error: Callable[..., FloatArray], naive: Callable[..., Any], misaligned: Callable[..., str]
) -> None:  # fmt: skip
    paper = naive(states, (angle,) * 3).error[-1] + np.array(PAPER_MINUS_CLEAN[states, angle])
    difference = paper - end_error(f"static_{states}", misaligned(angle), "source.noise=false", FAST)
    assert np.all(np.abs(difference) < (0.07, 0.004, 0.009)), difference


@pytest.mark.parametrize(("angle", "arcmin"), [(1.0, 2.75), (5.0, -10.24), (10.0, -61.36)])
def test_published_headings_of_the_7_state_filter(
    angle: float, arcmin: float, end_error: Callable[..., FloatArray], misaligned: Callable[..., str]
) -> None:
    # Magnitudes: Table 2, that its own text sums up as 2.7', 9.8' and 40.5'; signs: the second-order term -a^2/2.
    heading = end_error("static_7", misaligned(angle), "source.noise=false", FAST)[0]
    assert abs(heading - arcmin / 60.0) < 0.07


@pytest.mark.parametrize(("angle", "arcmin"), [(1.0, 2.75), (5.0, -10.24), (10.0, -61.36)])
def test_printed_differences_and_published_headings_are_two_ways_to_one_table(
    angle: float, arcmin: float, naive: Callable[..., Any]
) -> None:
    paper = naive(7, (angle,) * 3).error[-1, 0] + PAPER_MINUS_CLEAN[7, angle][0]
    assert abs(paper - arcmin / 60.0) < 2e-4


def test_standard_gravity_in_ug_is_no_matter(
    end_error: Callable[..., FloatArray], misaligned: Callable[..., str]
) -> None:
    # The specification's ug is a millionth of the local g = 9.796184 m/s^2; the program's unit is one of 9.80665 m/s^2.
    local = 9.796184e-4
    settings = [misaligned(1.0), "source.noise=false", FAST]
    biases = f"source.accel_bias={local!r} m/s^2"
    prior = f"blocks.accel_bias.sigma={local!r} m/s^2"
    difference = end_error("static_10", *settings, biases, prior) - end_error("static_10", *settings)
    assert np.all(np.abs(difference) < 1e-5)
    assert np.any(difference != 0.0)
