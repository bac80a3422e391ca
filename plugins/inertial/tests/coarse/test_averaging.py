"""Alignment by averaging: right on a still base, wrong on a moving one, and it says so."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.coarse_averaging import AveragingConfig, build_averaging, estimate_attitude
from estimfw_inertial.rotation import euler_angles
from estimfw_inertial.sensor_grade import SensorGrade
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.config.types import Site
from estimfw.data.record import Record, Stream
from estimfw.errors import DataError

FloatArray = NDArray[np.float64]
Measure = Callable[..., Any]

ARCMIN = np.radians(1.0 / 60.0)
GRADE = SensorGrade()


def phi_of(found: FloatArray, true: FloatArray) -> FloatArray:
    """phi with found = exp(-[phi x]) true."""
    return np.asarray(-Rotation.from_matrix(found @ true.T).as_rotvec())


@pytest.mark.parametrize("latitude", np.radians([1.0, 34.0, -60.0, 85.0]))
@pytest.mark.parametrize("seed", range(4))
def test_perfect_sensors_give_the_attitude_whatever_it_is(measure: Measure, latitude: float, seed: int) -> None:
    attitude = Rotation.random(random_state=seed).as_matrix()
    data = measure(np.random.default_rng(seed), latitude=latitude, attitude=attitude)
    found = estimate_attitude(data.t, data.dtheta, data.dvel, data.place)
    assert np.linalg.norm(phi_of(found.C_bn, data.C_bn)) < 1e-4 * ARCMIN


def nees(measure: Measure, runs: int, **fields: Any) -> float:
    rng = np.random.default_rng(4)
    total = 0.0
    for _ in range(runs):
        attitude = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        data = measure(rng, latitude=0.6, attitude=attitude, grade=GRADE, **fields)
        found = estimate_attitude(data.t, data.dtheta, data.dvel, data.place, GRADE)
        phi = phi_of(found.C_bn, data.C_bn)
        total += float(phi @ np.linalg.solve(found.covariance, phi))
    return total / runs


@pytest.mark.parametrize("quantum", [0.0, 1.2e-3])
def test_the_covariance_is_consistent_on_a_still_base(measure: Measure, quantum: float) -> None:
    assert abs(nees(measure, 60, quantum=quantum) - 3.0) < 3.3 * np.sqrt(6.0 / 60)


def test_the_covariance_grows_with_swaying(measure: Measure) -> None:
    """As long as the heading error stays small enough for a covariance to describe it."""
    swaying = {"duration": 300.0, "rate": 20.0, "sway": np.radians(0.02), "surge": 0.002}
    assert abs(nees(measure, 60, **swaying) - 3.0) < 3.3 * np.sqrt(6.0 / 60)


def test_on_the_public_record_the_heading_is_off_by_degrees_and_within_its_sigma(lasergyro: Path) -> None:
    with np.load(lasergyro / "lasergyro.npz", allow_pickle=False) as log:
        rows = slice(99, 30000)
        values, time = np.hstack([log["dtheta"][rows], log["dvel"][rows]]), log["t"][rows]
    columns = tuple(f"{name}_{axis}" for name in ("dtheta", "dvel") for axis in "xyz")
    record = Record({"imu": Stream("imu", time, values, columns, "increment", 0.01)})
    site = Site.model_validate({"latitude": "34.246048 deg", "longitude": "108.909664 deg", "height": "380 m"})
    config = AveragingConfig.model_validate({"kind": "inertial.averaging", "duration": "299 s"})
    found = build_averaging(config, site).find(record)
    miss = np.degrees(euler_angles(found.values["C_bn"])[0]) + 90.6
    sigma = np.degrees(np.sqrt(found.covariance["attitude"][2, 2]))
    assert 6.0 < abs(miss) < 8.5
    assert abs(miss) < 2.0 * sigma


def test_empty_gyros_are_refused() -> None:
    force = np.tile([0.0, 0.0, 0.098], (100, 1))
    with pytest.raises(DataError, match="show no north"):
        estimate_attitude(
            0.01 * np.arange(1, 101, dtype=np.float64), 0.0 * force, force, Site.model_validate({"latitude": "34 deg"})
        )


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda t, v: (np.where(t > 1.0, t + 0.05, t), v), "a gap of 0.06 s after 1 s, inside the coarse alignment"),
        (
            lambda t, v: (t, np.where((t == t[150])[:, None], np.nan, v)),
            "the sample at 1.51 s, inside the coarse alignment",
        ),
    ],
)
def test_holes_in_the_window_are_refused(spoil: Any, message: str) -> None:
    time, values = spoil(0.01 * np.arange(1, 1001), np.full((1000, 6), 1e-3))
    config = AveragingConfig.model_validate({"kind": "inertial.averaging", "duration": "5 s"})
    record = Record({"imu": Stream("imu", time, values, tuple("abcdef"), "increment", 0.01)})
    with pytest.raises(DataError, match=message):
        build_averaging(config, Site.model_validate({"latitude": "34 deg"})).find(record)


def test_a_record_without_imu_is_refused() -> None:
    config = AveragingConfig.model_validate({"kind": "inertial.averaging", "duration": "5 s"})
    with pytest.raises(DataError, match="needs the stream 'imu', which the source does not have\n  it has: none"):
        build_averaging(config, Site.model_validate({"latitude": "34 deg"})).find(Record({}))


def test_near_a_pole_there_is_a_warning() -> None:
    rng = np.random.default_rng(0)
    values = np.hstack([np.tile([0.0, 1e-8, 7e-7], (500, 1)), np.tile([0.0, 0.0, 0.098], (500, 1))])
    values += 1e-10 * rng.standard_normal(values.shape)
    record = Record(
        {"imu": Stream("imu", 0.01 * np.arange(1, 501, dtype=np.float64), values, tuple("abcdef"), "increment", 0.01)}
    )
    config = AveragingConfig.model_validate({"kind": "inertial.averaging", "duration": "5 s"})
    _, event = build_averaging(config, Site.model_validate({"latitude": "89.5 deg"})).find(record).events
    assert event.kind == "near pole"
