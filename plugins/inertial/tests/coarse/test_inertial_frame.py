"""Inertial-frame alignment: right at any attitude and latitude, on a swaying base, and as good as it says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.coarse_inertial import (
    InertialFrameConfig,
    build_inertial_frame,
    estimate_attitude,
    reaction_velocity,
)
from estimfw_inertial.earth import normal_gravity
from estimfw_inertial.log_config import ImuLogConfig
from estimfw_inertial.log_source import build_imu_log
from estimfw_inertial.rotation import euler_angles
from estimfw_inertial.sensor_grade import SensorGrade
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from estimfw.config.types import Site
from estimfw.errors import ConfigError, DataError, NumericalError
from estimfw.model.nominal import InitialNominal

FloatArray = NDArray[np.float64]
Measure = Callable[..., Any]

RATE = 7.292115e-5
ARCMIN = np.radians(1.0 / 60.0)
GRADE = SensorGrade()


def phi_of(found: FloatArray, true: FloatArray) -> FloatArray:
    """phi with found = exp(-[phi x]) true."""
    return np.asarray(-Rotation.from_matrix(found @ true.T).as_rotvec())


@pytest.mark.parametrize("latitude", np.radians([1.0, 34.0, -60.0, 85.0]))
@pytest.mark.parametrize("seed", range(4))
def test_perfect_sensors_give_the_attitude_whatever_it_is(measure: Measure, latitude: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    attitude = Rotation.random(random_state=seed).as_matrix()
    data = measure(rng, latitude=latitude, attitude=attitude, duration=60.0)
    found = estimate_attitude(data.t, data.dtheta, data.dvel, data.place)
    assert np.linalg.norm(phi_of(found.C_bn, data.C_bn)) < 1e-3 * ARCMIN
    assert found.time == data.t[-1]


def test_swaying_averages_out_of_the_heading(measure: Measure) -> None:
    rng = np.random.default_rng(2)
    data = measure(rng, latitude=0.6, attitude=np.eye(3), duration=300.0, sway=np.radians(1.0), surge=0.05)
    found = estimate_attitude(data.t, data.dtheta, data.dvel, data.place)
    phi = phi_of(found.C_bn, data.C_bn)
    assert abs(phi[2]) < 5.0 * ARCMIN
    assert np.linalg.norm(phi[:2]) < 0.2 * ARCMIN


def test_reaction_velocity_is_the_integral_of_a_vector_that_turns_with_the_earth(spot: Callable[[float], Any]) -> None:
    place = spot(0.6)
    rate = RATE * np.array([0.0, np.cos(0.6), np.sin(0.6)])

    def motion(_: float, state: FloatArray) -> FloatArray:
        return np.concatenate([np.cross(rate, state[:3]), state[:3]])

    up = np.array([0.0, 0.0, float(normal_gravity(0.6))])
    solution = solve_ivp(motion, (0.0, 3600.0), np.concatenate([up, np.zeros(3)]), rtol=1e-12, atol=1e-12)
    assert reaction_velocity(np.array([3600.0]), place)[0] == pytest.approx(solution.y[3:, -1], rel=1e-9)


def test_an_east_gyro_bias_alone_shows_as_its_known_heading_sigma(measure: Measure) -> None:
    data = measure(np.random.default_rng(0), latitude=0.6, attitude=np.eye(3), duration=60.0)
    gyros = SensorGrade(GRADE.gyro_bias, 0.0, 0.0, 0.0)
    covariance = estimate_attitude(data.t, data.dtheta, data.dvel, data.place, gyros).covariance
    assert np.sqrt(covariance[2, 2]) == pytest.approx(GRADE.gyro_bias / (RATE * np.cos(0.6)), rel=0.01)


def test_an_accelerometer_bias_ties_roll_and_heading_by_the_tangent_of_latitude(measure: Measure) -> None:
    data = measure(np.random.default_rng(0), latitude=0.6, attitude=np.eye(3), duration=60.0)
    accelerometers = SensorGrade(0.0, GRADE.accel_bias, 0.0, 0.0)
    covariance = estimate_attitude(data.t, data.dtheta, data.dvel, data.place, accelerometers).covariance
    tilt = (GRADE.accel_bias / 9.8) ** 2
    tangent = np.tan(0.6)
    expected = tilt * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, tangent], [0.0, tangent, tangent**2]])
    assert covariance == pytest.approx(expected, abs=0.01 * tilt)


def nees(measure: Measure, runs: int, seed: int, grade: SensorGrade = GRADE, **fields: Any) -> float:
    """Mean over runs of phi' P^-1 phi, at random attitudes."""
    rng = np.random.default_rng(seed)
    total = 0.0
    for _ in range(runs):
        attitude = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        data = measure(rng, attitude=attitude, grade=grade, **fields)
        found = estimate_attitude(data.t, data.dtheta, data.dvel, data.place, grade)
        phi = phi_of(found.C_bn, data.C_bn)
        total += float(phi @ np.linalg.solve(found.covariance, phi))
    return total / runs


STILL: dict[str, dict[str, Any]] = {"still": {}, "quantised": {"quantum": 1.2e-3}}
NOISY: dict[str, dict[str, Any]] = {
    "gyro noise": {"grade": SensorGrade(0.0, 0.0, 3e-5, 1e-5)},
    "accelerometer noise": {"grade": SensorGrade(0.0, 0.0, 3e-7, 3e-3)},
    "poor biases": {"grade": SensorGrade(5e-6, 5e-2, 3e-7, 1e-5)},
}


@pytest.mark.parametrize("case", [*STILL, *NOISY])
def test_the_covariance_is_consistent_on_a_still_base(measure: Measure, case: str) -> None:
    runs = 60
    mean = nees(measure, runs, 4, latitude=0.6, duration=60.0, **{**STILL, **NOISY}[case])
    assert abs(mean - 3.0) < 3.3 * np.sqrt(6.0 / runs)


def test_the_covariance_holds_on_a_swaying_base(measure: Measure) -> None:
    mean = nees(measure, 40, 5, latitude=0.6, duration=120.0, sway=np.radians(1.0), surge=0.05)
    assert 0.7 < mean < 3.0 + 3.3 * np.sqrt(6.0 / 40)


@pytest.mark.slow
@pytest.mark.parametrize("latitude", np.radians([1.0, 34.0, 80.0]))
@pytest.mark.parametrize("case", [*STILL, *NOISY])
def test_the_covariance_is_consistent_over_400_runs(measure: Measure, latitude: float, case: str) -> None:
    mean = nees(measure, 400, 6, latitude=latitude, duration=60.0, **{**STILL, **NOISY}[case])
    assert abs(mean - 3.0) < 3.3 * np.sqrt(6.0 / 400)


@pytest.mark.slow
@pytest.mark.parametrize("duration", [60.0, 120.0, 300.0])
@pytest.mark.parametrize("frequency", [0.1, 0.3, 1.0])
def test_the_covariance_holds_over_200_swaying_runs(measure: Measure, duration: float, frequency: float) -> None:
    swaying = {"sway": np.radians(1.0), "surge": 0.05, "frequency": frequency}
    mean = nees(measure, 200, 7, latitude=0.6, duration=duration, **swaying)
    assert 0.7 < mean < 3.0 + 3.3 * np.sqrt(6.0 / 200)


def finder(duration: str, site: Site | None) -> Any:
    config = InertialFrameConfig.model_validate({"kind": "inertial.inertial_frame", "duration": duration})
    return build_inertial_frame(config, site)


XIAN = Site.model_validate({"latitude": "34.246048 deg", "longitude": "108.909664 deg", "height": "380 m"})


def aligned(folder: Path, duration: str) -> InitialNominal:
    source = ImuLogConfig.model_validate({
        "kind": "inertial.imu_log", "file": str(folder / "lasergyro.npz"), "first_sample": 100, "last_sample": 30000
    })  # fmt: skip
    record = build_imu_log(source, XIAN, InitialNominal(values={})).load()
    found = finder(duration, XIAN).find(record)
    assert isinstance(found, InitialNominal)
    return found


def test_the_public_record_agrees_with_filters_over_the_same_five_minutes(lasergyro: Path) -> None:
    """12-state filters end near yaw -90.6, pitch 0.80, roll 0.31 deg; the record repeats to about 0.7 arcmin."""
    found = aligned(lasergyro, "299 s")
    assert found.time == pytest.approx(299.99)
    assert np.degrees(euler_angles(found.values["C_bn"])) == pytest.approx([-90.6, 0.80, 0.31], abs=1.0 / 60.0)
    assert found.values["velocity_n"].tolist() == [0.0, 0.0, 0.0]
    assert found.source == "inertial-frame alignment over 299 s"


def test_the_start_that_was_found_is_told(lasergyro: Path) -> None:
    found = aligned(lasergyro, "120 s")
    (event,) = found.events
    assert (event.source, event.kind, event.time) == ("coarse alignment", "start", found.time)
    sigma = float(np.degrees(np.sqrt(found.covariance["attitude"][2, 2])))
    assert event.text.startswith("inertial-frame alignment over 120 s, 0.99 to 120.99 s: yaw -90.")
    assert f"+- {sigma:.2g} deg, pitch 0.8" in event.text  # level to a degree: the sigma of yaw is that of phi about Up
    assert event.text.count(" deg") == 3
    assert f"roll {np.degrees(euler_angles(found.values['C_bn'])[2]):.4f} +- " in event.text


@pytest.mark.parametrize("duration", [60, 120])
def test_shorter_windows_of_the_public_record_agree_within_their_sigma(lasergyro: Path, duration: int) -> None:
    short, long = aligned(lasergyro, f"{duration} s"), aligned(lasergyro, "299 s")
    yaw = np.degrees(euler_angles(short.values["C_bn"])[0] - euler_angles(long.values["C_bn"])[0]) * 60.0
    sigma = np.degrees(np.sqrt(short.covariance["attitude"][2, 2])) * 60.0
    assert abs(yaw) < 4.0
    assert 8.0 < sigma < 15.0


def test_a_window_longer_than_the_record_is_refused(lasergyro: Path) -> None:
    with pytest.raises(DataError, match=r"is to last 400 s, the record has only 299\.01 s"):
        aligned(lasergyro, "400 s")


def test_a_window_of_a_few_samples_is_refused(lasergyro: Path) -> None:
    with pytest.raises(DataError, match=r"would use 10 samples of 0\.01 s, it needs 30"):
        aligned(lasergyro, "0.1 s")


@pytest.mark.parametrize("latitude", ["90 deg", "-90 deg", "89.9999 deg"])
def test_a_pole_has_no_north(latitude: str) -> None:
    with pytest.raises(NumericalError, match="at a pole the Earth's rate shows no north"):
        finder("60 s", Site.model_validate({"latitude": latitude}))


def test_without_a_site_there_is_no_alignment() -> None:
    with pytest.raises(ConfigError, match="needs the place") as caught:
        finder("60 s", None)
    assert "--set 'site={latitude: ..., longitude: ..., height: ...}'" in str(caught.value.hint)


def test_the_reference_is_level_and_faces_north() -> None:
    reference = finder("60 s", XIAN).reference()
    assert reference.values["C_bn"].tolist() == np.eye(3).tolist()
