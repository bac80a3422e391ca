"""What one position does not tell, by name, and that a second one does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.run.observe import observe

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]

RATE, G, L = 7.292115e-5, 9.80665, np.radians(39.1)


def hidden(alpha: float) -> FloatArray:
    """Tilts that hide biases, and an azimuth error that hides a drift, (3, 10): derived from F x = 0 by hand.

    A tilt about East needs g phi_E + dA_north = 0, and what it turns of the Earth's rate is met by drifts: W sin L phi_E about
    North, -W cos L phi_E in azimuth. Of a tilt about North -g phi_N + dA_east = 0, and -W sin L phi_N about East. An azimuth
    error: W cos L phi_U about East.
    """
    up, north, c, s = RATE * np.sin(L), RATE * np.cos(L), np.cos(alpha), np.sin(alpha)
    in_p = np.array([[c, s], [-s, c]])
    x = np.zeros((3, 10))
    x[0, 2], x[0, 5:7], x[0, 7:9], x[0, 9] = 1.0, in_p @ [0.0, -G], in_p @ [0.0, up], -north
    x[1, 3], x[1, 5:7], x[1, 7:9] = 1.0, in_p @ [G, 0.0], in_p @ [-up, 0.0]
    x[2, 4], x[2, 7:9] = 1.0, in_p @ [north, 0.0]
    return x


@pytest.mark.parametrize("alpha", [0.0, 30.0, 110.0])
def test_rank_is_7_and_the_kernel_is_that_of_the_equations(opened: Open, alpha: float) -> None:
    found = observe(opened("gravimeter", f"nominal.alpha={alpha} deg", "source.duration=60 s")).frozen
    assert found.rank == 7
    sigma = np.sqrt(np.diag(opened("gravimeter").model.prior.evaluate({})[1]))
    expected, kernel = (np.linalg.qr((m / sigma).T)[0] for m in (hidden(np.radians(alpha)), found.kernel.T))
    np.testing.assert_allclose(expected @ expected.T, kernel @ kernel.T, rtol=0.0, atol=1e-6)


def test_along_east_and_north_each_direction_has_two_names(opened: Open) -> None:
    told = opened("gravimeter", "nominal.alpha=0 deg").undetermined
    assert len(told) == 3
    for pair in (("attitude_error[E]", "accel_bias[y]"), ("attitude_error[N]", "accel_bias[x]"),
                 ("attitude_error[U]", "gyro_drift[x]")):  # fmt: skip
        assert any(all(name in text for name in pair) for text in told), (pair, told)


def test_a_second_position_tells_all(opened: Open) -> None:
    found = observe(opened("gravimeter_two_positions", "estimator.kernel=numba"))
    assert found.record is not None
    ranks = {segment.start: segment.rank for segment in found.record.segments}
    assert {rank for start, rank in ranks.items() if start < 600.0} == {7}
    assert {rank for start, rank in ranks.items() if start >= 600.0} == {10}
    assert opened("gravimeter_two_positions").undetermined == ()
