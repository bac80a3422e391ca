"""The start of a vehicle that moves: levelled, with one heading or several."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from estimfw_inertial.rotation import attitude_matrix, euler_angles
from estimfw_sins_odometer.level import LevelConfig, attitudes_about, level

from estimfw.data.record import Record
from estimfw.errors import DataError


def config(**fields: Any) -> LevelConfig:
    return LevelConfig.model_validate({"kind": "sins_odometer.level", **fields})


def test_with_the_true_up_and_heading_it_is_the_true_attitude() -> None:
    C = attitude_matrix(-0.7, 0.05, -0.1)
    assert attitudes_about(C[2], 0.7) == pytest.approx(C)


def test_a_moving_vehicle_is_levelled_within_its_own_acceleration(drive: Any) -> None:
    for seed in range(5):
        record = drive(seed=seed, duration="30 s")
        assert record.truth is not None
        found = level(config(), None).find(record).values["C_bn"]
        true = record.truth.values["C_bn"][0]
        assert np.degrees(np.arccos(found[2] @ true[2])) < 5.0


def test_eight_headings_lie_around_the_circle_and_share_their_covariance(drive: Any) -> None:
    found = level(config(headings=8, heading="10 deg"), None).find(drive(seed=1, duration="30 s"))
    headings = np.degrees(-euler_angles(found.values["C_bn"])[:, 0]) % 360.0
    assert headings == pytest.approx(10.0 + 45.0 * np.arange(8), abs=1e-6)
    assert found.candidates[:2] == ("heading 10 deg", "heading 55 deg") and len(found.candidates) == 8
    up = found.values["C_bn"][:, 2]
    assert np.allclose(up, up[0])
    P = found.covariance["attitude"]
    assert np.sqrt(up[0] @ P @ up[0]) == pytest.approx(np.radians(30.0))
    assert np.sqrt(np.linalg.eigvalsh(P)[:2]) == pytest.approx(np.radians([5.0, 5.0]))


def test_a_later_start_is_later(drive: Any) -> None:
    record = drive(seed=1, duration="30 s")
    assert level(config(skip="2 s"), None).find(record).time == pytest.approx(record.streams["imu"].time[0] + 2.0)


def test_a_record_without_an_imu_or_too_short_is_refused(drive: Any) -> None:
    with pytest.raises(DataError, match="needs the stream 'imu'"):
        level(config(), None).find(Record({}))
    with pytest.raises(DataError, match="shorter than"):
        level(config(skip="60 s"), None).find(drive(seed=1, duration="30 s"))
