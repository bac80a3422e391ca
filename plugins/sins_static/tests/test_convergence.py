"""How soon the heading is known, noise-free."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest


def settling_time(done: Any, tolerance: float) -> float:
    """From then on (s) the heading stays within ``tolerance`` (deg) of its last value."""
    heading = np.degrees(done.output_error[:, 0])
    outside = np.flatnonzero(np.abs(heading - heading[-1]) >= tolerance)
    return float(done.prepared.steps.time[outside[-1] + 1])


@pytest.mark.parametrize("states", [7, 10, 12])
@pytest.mark.parametrize(("angle", "half_deg", "tenth_deg"), [(1.0, 59, 91), (5.0, 90, 127), (10.0, 103, 149)])
def test_heading_settles_when_the_specification_says(
    states: int, angle: float, half_deg: float, tenth_deg: float, ran: Callable[..., Any], misaligned: Callable[..., str]
) -> None:  # fmt: skip
    done = ran(f"static_{states}", misaligned(angle), "source.noise=false", "estimator.kernel=numba")
    assert abs(settling_time(done, 0.5) - half_deg) <= 4.0
    assert abs(settling_time(done, 0.1) - tenth_deg) <= 4.0


@pytest.mark.parametrize(("angle", "half_deg", "tenth_deg"), [(1.0, 24, 37), (5.0, 36, 52), (10.0, 42, 61)])
def test_smaller_measurement_noise_settles_sooner(
    angle: float, half_deg: float, tenth_deg: float, ran: Callable[..., Any], misaligned: Callable[..., str]
) -> None:
    quiet = "measurements.zero_velocity.noise=0.01 m/s"
    done = ran("static_7", misaligned(angle), "source.noise=false", quiet, "estimator.kernel=numba")
    assert abs(settling_time(done, 0.5) - half_deg) <= 4.0
    assert abs(settling_time(done, 0.1) - tenth_deg) <= 4.0


def test_the_12_states_are_slow_only_at_a_large_angle_and_with_small_measurement_noise(
    ran: Callable[..., Any], misaligned: Callable[..., str]
) -> None:
    quiet = "measurements.zero_velocity.noise=0.01 m/s"
    done = ran("static_12", misaligned(10.0), "source.noise=false", quiet, "estimator.kernel=numba")
    assert abs(settling_time(done, 0.1) - 489.0) <= 4.0
