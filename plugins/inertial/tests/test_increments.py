"""Samples out of an IMU stream: the time that increments cover, and what cannot be mechanized."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from estimfw_inertial.increments import IMU_COLUMNS, imu_samples
from numpy.typing import NDArray

from estimfw.data.record import Stream
from estimfw.errors import DataError

FloatArray = NDArray[np.float64]


def stream(
    time: Any, period: float | None = 0.01, columns: tuple[str, ...] = IMU_COLUMNS, kind: Any = "increment"
) -> Stream:
    time = np.asarray(time, dtype=float)
    values = np.random.default_rng(1).normal(size=(time.size, len(columns)))
    return Stream("imu", time, values, columns, kind, period)


def covered(time: Any, period: float | None = 0.01) -> FloatArray:
    made = stream(time, period)
    return imu_samples(made, np.arange(len(made) + 1, dtype=np.int64), 1)[:, 0]


def test_equal_steps_are_equal_to_the_last_bit() -> None:
    """So that a time-invariant plan finds one step length, although 0.01 k is not on a binary grid."""
    assert set(covered(0.01 * np.arange(1, 1000))) == {0.01}


def test_over_a_gap_the_increments_cover_one_period() -> None:
    assert covered([0.01, 0.02, 0.52, 0.53]) == pytest.approx([0.01] * 4)


def test_jitter_of_the_stamps_is_the_time_that_was_covered() -> None:
    assert covered([0.010, 0.021, 0.030]) == pytest.approx([0.010, 0.011, 0.009])


def test_without_a_period_the_typical_interval_stands_for_it() -> None:
    assert covered([1.0, 1.5, 2.0, 2.5], None) == pytest.approx([0.5] * 4)


def test_rows_and_columns_are_chosen_whatever_stands_beside_them() -> None:
    made = stream(0.01 * np.arange(1, 9), columns=("temperature", *reversed(IMU_COLUMNS)))
    samples = imu_samples(made, np.array([2, 4, 6], dtype=np.int64), 2)
    assert samples.shape == (2, 13)
    expected = made.values[2:6, :0:-1].reshape(2, 12)
    assert np.array_equal(samples[:, 1:], expected)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (stream([1.0, 2.0], 1.0, IMU_COLUMNS[:5]), "has no column dvel_z"),
        (stream([1.0, 2.0], 1.0, kind="sample"), "values at instants"),
        (stream([1.0, 2.0, 2.0], 1.0), "row 3, 2 s, is not after"),
        (stream([1.0], None), "one row and no period"),
    ],
    ids=["a column is missing", "rates", "time stands still", "no period"],
)
def test_what_cannot_be_mechanized_is_refused(made: Stream, message: str) -> None:
    with pytest.raises(DataError, match=message):
        imu_samples(made, np.array([0, len(made)], dtype=np.int64), len(made))


def test_a_number_that_is_none_is_refused_with_its_time() -> None:
    made = stream([0.01, 0.02, 0.03])
    made.values[1, 4] = np.nan
    with pytest.raises(DataError, match=r"the sample at 0\.02 s is not a number \(1 such samples\)"):
        imu_samples(made, np.arange(4, dtype=np.int64), 1)
