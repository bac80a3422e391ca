"""The simulated experiment: increments, noises, start, and the override paths that others rely on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

DEGREE = np.pi / 180.0
EARTH_RATE = 7.292115e-5
TILTED = ("initial_attitude.yaw=40 deg", "initial_attitude.pitch=10 deg", "initial_attitude.roll=-20 deg")


def earth_rate_n(latitude_deg: float) -> FloatArray:
    return EARTH_RATE * np.array([0.0, np.cos(latitude_deg * DEGREE), np.sin(latitude_deg * DEGREE)])


def somigliana(latitude_deg: float, height: float) -> float:
    """WGS-84 normal gravity with the free-air gradient, m/s^2."""
    s2 = np.sin(latitude_deg * DEGREE) ** 2
    on_ellipsoid = 9.7803253359 * (1.0 + 0.00193185265241 * s2) / np.sqrt(1.0 - 0.00669437999014 * s2)
    return float(on_ellipsoid - 3.086e-6 * height)


@pytest.mark.parametrize("latitude", [34.0, -45.0, 70.0])
@pytest.mark.parametrize("rate", [1.0, 20.0])
def test_noise_free_increments_are_earth_rate_and_gravity_plus_biases(
    latitude: float, rate: float, composed: Callable[..., Any]
) -> None:
    biases = ("source.gyro_bias=[0.1 deg/h, -0.2 deg/h, 0.3 deg/h]", "source.accel_bias=[100 ug, 200 ug, -300 ug]")
    problem = composed(
        "static_12", f"site.latitude={latitude} deg", f"source.rate={rate} Hz", "source.duration=10 s",
        "source.noise=false", *biases, *TILTED,
    )  # fmt: skip
    imu = problem.source.load().streams["imu"]
    C_bn = Rotation.from_euler("ZXY", (40.0, 10.0, -20.0), degrees=True)
    omega = C_bn.inv().apply(earth_rate_n(latitude)) + np.array([0.1, -0.2, 0.3]) * DEGREE / 3600.0
    force = C_bn.inv().apply([0.0, 0.0, somigliana(latitude, 100.0)]) + np.array([100.0, 200.0, -300.0]) * 9.80665e-6
    assert imu.kind == "increment"
    assert len(imu) == round(10 * rate)
    np.testing.assert_allclose(imu.time[[0, -1]], [1.0 / rate, 10.0])
    np.testing.assert_allclose(imu.values[:, :3] * rate, np.broadcast_to(omega, (len(imu), 3)), rtol=1e-9, atol=1e-14)
    np.testing.assert_allclose(imu.values[:, 3:] * rate, np.broadcast_to(force, (len(imu), 3)), atol=2e-6)


def test_gravity_of_the_papers_place(composed: Callable[..., Any]) -> None:
    assert composed("static_12").reference["gravity"] == pytest.approx(9.796184, abs=5e-7)
    np.testing.assert_allclose(
        composed("static_12").reference["earth_rate_n"], (0.0, 6.045437e-5, 4.077699e-5), atol=1e-11
    )


@pytest.mark.parametrize("rate", [1.0, 10.0])
def test_noise_has_the_random_walks_of_the_sensors_at_any_rate(rate: float, composed: Callable[..., Any]) -> None:
    settings = (f"source.rate={rate} Hz", "source.duration=4000 s")
    noisy, clean = (
        composed("static_12", *settings, f"source.noise={on}").source.load().streams["imu"].values
        for on in ("true", "false")
    )
    noise = noisy - clean
    count = len(noise)
    expected = np.array([0.001 * DEGREE / 60.0] * 3 + [10.0 * 9.80665e-6] * 3) / np.sqrt(rate)
    np.testing.assert_allclose(noise.std(axis=0), expected, rtol=4.0 / np.sqrt(2.0 * count))
    assert np.all(np.abs(noise.mean(axis=0)) < 4.0 * expected / np.sqrt(count))
    correlation = np.corrcoef(noise.T) - np.eye(6)
    assert np.all(np.abs(correlation) < 5.0 / np.sqrt(count))


def test_start_is_the_true_attitude_turned_back_by_the_misalignment_vector(composed: Callable[..., Any]) -> None:
    problem = composed("static_12", "source.misalignment=[1 deg, -2 deg, 3 deg]", *TILTED)
    record = problem.source.load()
    true = Rotation.from_euler("ZXY", (40.0, 10.0, -20.0), degrees=True)
    expected = Rotation.from_rotvec(-np.array([1.0, -2.0, 3.0]) * DEGREE) * true
    np.testing.assert_allclose(record.initial["C_bn"], expected.as_matrix(), atol=1e-14)
    np.testing.assert_allclose(record.truth.values["C_bn"][0], true.as_matrix(), atol=1e-14)


def test_swaying_base_integrates_back_to_its_own_attitude(composed: Callable[..., Any]) -> None:
    sway = "source.sway={amplitude: [1 deg, 2 deg, 3 deg], period: 8 s}"
    free = ("source.noise=false", "source.gyro_bias=0 deg/h", "source.accel_bias=0 ug")
    record = composed("static_12", sway, *free, "source.duration=60 s", "source.rate=10 Hz", *TILTED).source.load()
    C = Rotation.from_euler("ZXY", (40.0, 10.0, -20.0), degrees=True)
    earth = Rotation.from_rotvec(-earth_rate_n(34.0) * 0.1)
    found = []
    for dtheta in record.streams["imu"].values[:, :3]:
        C = earth * C * Rotation.from_rotvec(dtheta)
        found.append(C.as_matrix())
    np.testing.assert_allclose(found, record.truth.values["C_bn"], atol=1e-12)
    quarter = Rotation.from_rotvec(np.array([1.0, 2.0, 3.0]) * DEGREE).as_matrix()  # at 2 s, a quarter of the period
    start = Rotation.from_euler("ZXY", (40.0, 10.0, -20.0), degrees=True).as_matrix()
    np.testing.assert_allclose(record.truth.values["C_bn"][19], quarter @ start, atol=1e-12)


def test_velocity_noise_makes_the_reference_that_zero_velocity_is_compared_with(composed: Callable[..., Any]) -> None:
    record = composed("static_12", "source.velocity_noise=0.1 m/s", "source.duration=4000 s").source.load()
    reference = record.streams["velocity_reference"]
    assert reference.columns == ("E", "N", "U")
    np.testing.assert_allclose(reference.values.std(axis=0), 0.1, rtol=0.05)
    assert "velocity_reference" not in composed("static_12").source.load().streams


@pytest.mark.parametrize("latitude", [10.0, 60.0, -34.0])
def test_override_of_the_latitude_moves_the_limit_of_the_heading(
    latitude: float, end_error: Callable[..., FloatArray], misaligned: Callable[..., str]
) -> None:
    # epsE / wN - (aE / g) tanL + (epsU + wN aN / g) T / 2
    _, w_N, w_U = earth_rate_n(latitude)
    eps, tilt = 0.01 * DEGREE / 3600.0, 100.0 * 9.80665e-6 / somigliana(latitude, 100.0)
    limit = eps / w_N - tilt * w_U / w_N + (eps + w_N * tilt) * 300.0
    settings = (f"site.latitude={latitude} deg", "source.noise=false", "estimator.kernel=numba")
    assert end_error("static_7", misaligned(1e-4), *settings)[0] == pytest.approx(limit / DEGREE, abs=2e-4)


def test_override_of_one_misalignment_for_all_axes(composed: Callable[..., Any]) -> None:
    three = "[2 deg, 2 deg, 2 deg]"
    records = [composed("static_12", f"source.misalignment={m}").source.load() for m in ("2 deg", three)]
    np.testing.assert_array_equal(records[0].initial["C_bn"], records[1].initial["C_bn"])


@pytest.mark.parametrize(("name", "angle"), [("yaw", -92.0), ("pitch", 5.0), ("roll", -7.0)])
def test_override_of_the_initial_attitude_is_where_the_vehicle_stands(
    name: str, angle: float, ran: Callable[..., Any]
) -> None:
    done = ran("static_7", f"initial_attitude.{name}={angle} deg", "source.noise=false", "estimator.kernel=numba")
    expected = {"yaw": 0.0, "pitch": 0.0, "roll": 0.0, name: angle}
    np.testing.assert_allclose(np.degrees(done.output_truth[-1, :3]), list(expected.values()), atol=1e-9)
    np.testing.assert_allclose(np.degrees(done.output[-1, :3]), list(expected.values()), atol=0.06)


def test_override_of_the_seed_is_in_the_provenance(ran: Callable[..., Any]) -> None:
    done = ran("static_7", "source.seed=42", "source.duration=5 s")
    assert done.prepared.record.attributes["seed"] == 42
