"""The simulated platform: truth and readings, and errors of the filter that are as large as it says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.montecarlo.campaign import run_campaign
from estimfw.montecarlo.dataset import campaign_dataset
from estimfw.run.from_python import open_filter
from estimfw.run.load import load_record
from estimfw.run.run import run_problem
from estimfw.testing import check_draws

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]

ARCMIN = np.pi / 10800.0


def scaled(size: float) -> tuple[str, ...]:
    """The errors of the scenario, so many times as large."""
    return (
        f"source.attitude_error=[{6 * size} arcmin, {-6 * size} arcmin, {30 * size} arcmin]",
        f"source.accel_bias=[{50 * size} ug, {-50 * size} ug]",
        f"source.gyro_drift=[{0.01 * size} deg/h, {0.02 * size} deg/h, {-0.01 * size} deg/h]",
        "source.noise=false",
    )


def test_the_truth_follows_the_linear_model_but_for_squares(opened: Open) -> None:
    """After 20 min, 0.6 % of the velocity are of second order: tilt times azimuth error; a quarter of it with half the errors."""
    problem = opened("gravimeter")
    plan = problem.plan
    Phi = expm(1200.0 * plan.F.evaluate(plan.layout.complete(plan.layout.pack(problem.reference))))
    bias, drift = np.array([50.0, -50.0]) * 9.80665e-6, np.radians([0.01, 0.02, -0.01]) / 3600.0
    linear = Phi @ np.concatenate([np.zeros(2), ARCMIN * np.array([6.0, -6.0, 30.0]), bias, drift])

    def left(size: float) -> FloatArray:
        record = load_record(opened("gravimeter", *scaled(size)))
        assert record.truth is not None
        values = record.truth.values
        np.testing.assert_allclose(values["accel_bias_p"], [*size * bias, 0.0])
        np.testing.assert_allclose(values["gyro_drift_p"], size * drift)
        np.testing.assert_array_equal(record.streams["velocity"].values, values["velocity_error_n"][:, :2])
        x = np.concatenate([values["velocity_error_n"][-1, :2], values["attitude_error_n"][-1]])
        return np.asarray(x - size * linear[:5])

    whole, half = left(1.0), left(0.5)
    assert np.linalg.norm(whole[:2]) == pytest.approx(0.006 * np.linalg.norm(linear[:2]), rel=0.1)
    np.testing.assert_allclose(half, whole / 4.0, rtol=0.02)


def test_the_velocity_of_a_drift_free_platform_that_is_level_stays_zero(opened: Open) -> None:
    quiet = ("source.attitude_error=0 deg", "source.accel_bias=0 ug", "source.gyro_drift=0 deg/h", "source.noise=false")
    record = load_record(opened("gravimeter_two_positions", *quiet))
    assert np.max(np.abs(record.streams["velocity"].values)) < 1e-12


def test_a_turn_of_the_platform_takes_its_sensors_along(opened: Open) -> None:
    """Schuler's motion: a bias b makes V = b / w sin(w t), w^2 = g / R; a turn of 180 deg adds one of -2 b."""
    still = ("source.attitude_error=0 deg", "source.gyro_drift=0 deg/h", "source.noise=false", "site.latitude=0 deg")
    turned = "nominal.positions=[{alpha: 30 deg}, {time: 600 s, alpha: 210 deg}]"
    record = load_record(opened("gravimeter_two_positions", turned, *still))
    w = np.sqrt(9.80665 / 6371000.0)
    east, north = np.array([[np.cos(np.pi / 6), 0.5], [0.5, -np.cos(np.pi / 6)]]) @ [50e-6 * 9.80665, 50e-6 * 9.80665]
    swing = np.array([np.sin(600.0 * w), np.sin(1200.0 * w) - 2.0 * np.sin(600.0 * w)]) / w
    V = record.streams["velocity"].values[[599, 1199]]
    np.testing.assert_allclose(V, swing[:, None] * [east, north], rtol=0.01)
    assert record.truth is not None
    C = record.truth.values["C_pn"]
    azimuth = np.degrees(np.arctan2(C[[599, 600], 1, 0], C[[599, 600], 0, 0]))
    np.testing.assert_allclose(azimuth, [30.0, -150.0], atol=0.01)


def test_a_turn_between_two_readings_is_met_at_its_instant(opened: Open) -> None:
    turned = "nominal.positions=[{alpha: 30 deg}, {time: 600.25 s, alpha: 120 deg}]"
    done = run_problem(opened("gravimeter_two_positions", turned))
    assert 600.25 in done.prepared.steps.time
    assert len(done.prepared.steps) == 1201
    assert done.truth is not None and np.all(np.abs((done.estimate - done.truth)[-1]) < 4.0 * done.sigma[-1])


def test_the_draws_keep_their_contract(opened: Open) -> None:
    check_draws(opened("gravimeter_two_positions", "source.duration=20 s"))


def test_another_nominal_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "filter.yaml"
    path.write_text(
        "estimfw: 1\nblocks: {x: {kind: random_constant, unit: m, sigma: 1 m}}\n"
        "measurements: {velocity: {kind: direct, of: [{block: x}], noise: 1 m}}\nsource: {kind: platform_gravimeter.simulate}\n"
    )
    with pytest.raises(ConfigError, match="does not know how the platform stands"):
        load_record(open_filter(path))


#: Small errors of attitude, so that what is of second order in them (a tilt times the azimuth error) stays below the sigmas.
SMALL = ("blocks.attitude_error.sigma=[0.01 deg, 0.01 deg, 0.1 deg]", "estimator.kernel=numba")


def assert_consistent(problem: Problem, runs: int) -> None:
    """NEES within 3.3 deviations of the mean of so many runs at the end; nothing that is judged along the run fails."""
    dataset = campaign_dataset(run_campaign(problem, 2026, runs))
    nees = float(dataset["end_nees"].sel(quantity="all states").mean())
    assert abs(nees - 10.0) < 3.3 * np.sqrt(20.0 / runs), nees
    assert [e for e in json.loads(dataset.attrs["judged"]) if e["checked"] and not e["consistent"]] == []


@pytest.mark.parametrize("name", ["gravimeter", "gravimeter_two_positions"])
def test_errors_are_as_large_as_the_filter_says(opened: Open, name: str) -> None:
    assert_consistent(opened(name, *SMALL), 60)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gravimeter", "gravimeter_two_positions"])
def test_errors_of_500_runs_are_as_large_as_the_filter_says(opened: Open, name: str) -> None:
    assert_consistent(opened(name, *SMALL), 500)


def test_a_wrong_scale_of_the_noise_does_not_pass(opened: Open) -> None:
    with pytest.raises(AssertionError):
        assert_consistent(opened("gravimeter", *SMALL, "measurements.velocity.noise=0.005 m/s"), 40)
