"""A lag that was put in is found, to a fraction of a row, and no lag is found where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.data.preprocessing.lag import LagLimit, lag_between, lag_events
from estimfw.data.record import Stream

FloatArray = NDArray[np.float64]
PERIOD = 0.01
TIME: FloatArray = np.asarray(PERIOD * np.arange(1, 12001), dtype=float)
LIMIT = LagLimit("speed", "dvel_y", "rate_of_change", largest=0.1, within=5.0, least=0.5)


def speed(time: FloatArray) -> FloatArray:
    """A drive of 120 s with random changes of speed, up to 0.25 Hz."""
    rng = np.random.default_rng(8)
    frequency, phase = rng.uniform(0.01, 0.25, 40), rng.uniform(0.0, 2.0 * np.pi, 40)
    return np.asarray(12.0 + np.sum(np.sin(2.0 * np.pi * frequency * time[:, None] + phase), axis=1))


def joined(late: float, noise: float = 0.07) -> Stream:
    """Increments of the true speed with an accelerometer's bias, and the speed as a late sensor has it."""
    rng = np.random.default_rng(9)
    gained = np.diff(speed(np.concatenate([[0.0], TIME]))) + 1e-3 * PERIOD + 1e-4 * rng.standard_normal(TIME.size)
    seen = speed(TIME - late) + noise * rng.standard_normal(TIME.size)
    return Stream("imu", TIME, np.stack([gained, seen], axis=1), ("dvel_y", "speed"), "increment", PERIOD)


@pytest.mark.parametrize("late", [0.0, 0.3, -0.3, 2.0, 0.123])
def test_a_lag_that_was_put_in_is_found(late: float) -> None:
    found = lag_between(speed(TIME - late), speed(TIME), PERIOD, 5.0)
    assert found.seconds == pytest.approx(late, abs=0.005)
    assert found.correlation > 0.95


@pytest.mark.parametrize(
    ("late", "says"),
    [(0.3, "speed lags dvel_y by 0."), (-2.0, "speed leads dvel_y by ")],
)
def test_a_late_speed_beside_increments_is_told_with_its_cure(late: float, says: str) -> None:
    (event,) = lag_events(joined(late), LIMIT)
    assert (event.kind, event.source) == ("lag", "imu")
    assert says in event.text
    latency = float(event.text.rpartition("latency: ")[2].split()[0])
    assert latency == pytest.approx(late, abs=0.03)


def test_clocks_that_agree_are_not_flagged_nor_is_a_hole_taken_for_a_motion() -> None:
    assert lag_events(joined(0.0), LIMIT) == ()
    holed = joined(0.0)
    holed.values[3000:3500, 1] = np.nan
    assert lag_events(holed, LIMIT) == ()


def test_columns_of_different_motions_are_told_to_be_so() -> None:
    stream = joined(0.0)
    stream.values[:, 1] = np.random.default_rng(1).standard_normal(TIME.size)
    (event,) = lag_events(stream, LIMIT)
    assert "agree at no lag up to 5 s" in event.text


def test_of_several_runs_the_worst_is_told() -> None:
    runs = [joined(late) for late in (0.0, 0.5, -0.2)]
    together = Stream("imu", TIME, np.stack([r.values for r in runs]), runs[0].columns, "increment", PERIOD)
    (event,) = lag_events(together, LIMIT)
    assert float(event.text.rpartition("latency: ")[2].split()[0]) == pytest.approx(0.5, abs=0.03)
