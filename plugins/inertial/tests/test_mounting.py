"""The mounting of an IMU: its case's axes turned into the vehicle's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from estimfw_inertial.mounting import Mounting, MountingConfig, mounting
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.data.record import Stream
from estimfw.errors import DataError

FloatArray = NDArray[np.float64]
COLUMNS = tuple(f"{what}_{axis}" for what in ("dtheta", "dvel") for axis in "xyz")


def stream(values: Any, columns: tuple[str, ...] = COLUMNS) -> Stream:
    values = np.atleast_2d(np.asarray(values, dtype=float))
    return Stream("imu", np.arange(1.0, len(values) + 1.0), values, columns, "increment", 1.0)


def test_an_imu_turned_to_the_left_feels_a_forward_push_along_its_own_right() -> None:
    """Yaw 90 deg: the case's forward axis points to the vehicle's left, its right axis forward."""
    turned = Mounting(yaw=np.radians(90.0))
    felt_by_case = [0.0, 0.0, 0.1, 2.0, 0.0, 9.8]
    assert turned.apply(stream(felt_by_case)).values[0] == pytest.approx([0.0, 0.0, 0.1, 0.0, 2.0, 9.8], abs=1e-15)


def test_an_imu_upside_down_feels_gravity_from_below() -> None:
    over = Mounting(roll=np.radians(180.0))
    assert over.apply(stream([0.1, 0.2, 0.3, 0.0, 0.0, -9.8])).values[0] == pytest.approx(
        [-0.1, 0.2, -0.3, 0.0, 0.0, 9.8], abs=1e-14
    )


def test_every_triad_is_turned_alike_and_other_columns_stay() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=(20, 8))
    columns = ("temperature", *COLUMNS, "single_x")
    case = Mounting(0.3, -0.2, 1.1)
    found = case.apply(stream(values, columns))
    turn = Rotation.from_euler("ZXY", [0.3, -0.2, 1.1])
    assert found.columns == columns
    assert np.array_equal(found.values[:, [0, 7]], values[:, [0, 7]])
    assert found.values[:, 1:4] == pytest.approx(turn.apply(values[:, 1:4]), abs=1e-14)
    assert found.values[:, 4:7] == pytest.approx(turn.apply(values[:, 4:7]), abs=1e-14)
    assert np.array_equal(found.time, stream(values, columns).time)


def test_columns_of_a_triad_are_found_wherever_they_stand() -> None:
    mixed = ("dtheta_z", "dvel_y", "dtheta_x", "dvel_x", "dtheta_y", "dvel_z")
    values = np.arange(6.0)
    found = Mounting(yaw=np.radians(90.0)).apply(stream(values, mixed)).values[0]
    by_name = dict(zip(mixed, found, strict=True))
    assert by_name == pytest.approx(
        {"dtheta_x": -4.0, "dtheta_y": 2.0, "dtheta_z": 0.0, "dvel_x": -1.0, "dvel_y": 3.0, "dvel_z": 5.0}, abs=1e-15
    )


def test_a_lost_sample_stays_lost() -> None:
    found = Mounting(0.3, 0.2, 0.1).apply(stream([[np.nan] * 6, [1.0] * 6])).values
    assert np.isnan(found[0]).all()
    assert np.isfinite(found[1]).all()


def test_no_turn_leaves_every_bit() -> None:
    values = np.random.default_rng(2).normal(size=(5, 6))
    assert np.array_equal(mounting(MountingConfig()).apply(stream(values)).values, values)


def test_angles_of_a_config_carry_units() -> None:
    found = mounting(MountingConfig.model_validate({"yaw": "90 deg", "pitch": "0.1 rad"}))
    assert (found.yaw, found.pitch, found.roll) == pytest.approx((np.pi / 2.0, 0.1, 0.0))


def test_a_stream_without_a_whole_triad_is_refused() -> None:
    with pytest.raises(DataError, match="no columns name_x, name_y, name_z") as caught:
        Mounting(0.1).apply(stream([1.0, 2.0], ("speed_x", "speed_y")))
    assert "speed_x, speed_y" in str(caught.value.hint)
