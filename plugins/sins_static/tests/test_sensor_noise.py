"""Sensors that are noisier than the model has them are flagged; vibration, sway and resolution are no noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimfw_sins_static.sensor_noise import SensorNoiseConfig, SensorNoiseMonitor, white_density

from estimfw.data.record import Event, Record
from estimfw.errors import DataError
from estimfw.run.run import run_problem

Composed = Callable[..., Any]

LONG = ("source.rate=100 Hz", "source.duration=300 s")
UG = 9.80665e-6


def found(problem: Any, record: Record | None = None, factor: float = 5.0) -> tuple[Event, ...]:
    monitor = SensorNoiseMonitor("noise", SensorNoiseConfig(kind="sins_static.sensor_noise", factor=factor))
    return monitor.inspect_for(record or problem.source.load(), problem.full).events


def shaken(record: Record, change: Callable[[Any, float], Any]) -> Record:
    imu = record.streams["imu"]
    assert imu.period is not None
    return replace(record, streams={"imu": replace(imu, values=change(imu.values.copy(), imu.period))})


def test_the_density_is_that_of_white_noise(composed: Composed) -> None:
    imu = composed("static_12", *LONG).source.load().streams["imu"]
    expected = [np.radians(0.001) / 60.0] * 3 + [10.0 * UG] * 3
    # The least of four estimates, of which the one over 10 s has 30 differences.
    assert np.all(white_density(imu) < 1.05 * np.array(expected))
    assert np.all(white_density(imu) > 0.4 * np.array(expected))


def test_half_a_degree_a_second_and_20_mg_in_each_sample_are_flagged(composed: Composed) -> None:
    rng = np.random.default_rng(2)
    problem = composed("static_12", *LONG)

    def noisy(values: Any, dt: float) -> Any:
        sigma = np.repeat([np.radians(0.5), 20e3 * UG], 3)
        return values + dt * sigma * rng.standard_normal(values.shape)

    gyros, accelerometers = found(problem, shaken(problem.source.load(), noisy))
    assert (gyros.source, gyros.kind, accelerometers.kind) == ("noise", "noise", "noise")
    assert "the model has 0.001 deg/sqrt(h): its sigmas are too small; raise `gyro_noise`" in gyros.text
    assert "the model has 10 ug/sqrt(Hz)" in accelerometers.text
    # 0.5 deg/s at 100 Hz is 3 deg/sqrt(h), 20 mg is 2000 ug/sqrt(Hz)
    assert float(gyros.text.split("is that of ")[1].split()[0]) == pytest.approx(3.0, rel=0.4)
    assert float(accelerometers.text.split("is that of ")[1].split()[0]) == pytest.approx(2000.0, rel=0.4)


def test_the_event_reaches_the_result(composed: Composed) -> None:
    monitor = "monitors={noise: {kind: sins_static.sensor_noise}}"
    done = run_problem(composed("static_12", monitor, *LONG, "source.duration=60 s", "source.gyro_noise=3 deg/sqrt(h)"))
    assert [e.source for e in done.events if e.kind == "noise"] == ["noise"]


def test_noise_that_the_model_has_is_not_flagged(composed: Composed) -> None:
    noisy = ("process.phi_angle.gyro_noise=3 deg/sqrt(h)", "process.phi_angle.accel_noise=2000 ug/sqrt(Hz)")
    as_noisy = ("source.gyro_noise=3 deg/sqrt(h)", "source.accel_noise=2000 ug/sqrt(Hz)")
    assert found(composed("static_12", *LONG, *noisy, *as_noisy)) == ()
    assert len(found(composed("static_12", *LONG, *as_noisy))) == 2


@pytest.mark.parametrize("policies", ["static_12", "static_7"])
def test_the_noises_compared_are_those_of_the_whole_model(policies: str, composed: Composed) -> None:
    assert len(found(composed(policies, *LONG, "source.gyro_noise=3 deg/sqrt(h)"))) == 1


def test_vibration_sway_and_coarse_resolution_are_no_noise(composed: Composed) -> None:
    problem = composed(
        "static_12", *LONG, "source.sway={amplitude: [0.1 deg, 0.1 deg, 0.1 deg], period: 8 s}",
    )  # fmt: skip

    def vibrating(values: Any, dt: float) -> Any:
        time = dt * np.arange(len(values))[:, None]
        values[:, 3:] += 3.0 * dt * np.sin(2.0 * np.pi * 17.3 * time + np.arange(3))
        return np.round(values / 1e-3) * 1e-3

    assert found(problem) == ()
    assert found(problem, shaken(problem.source.load(), vibrating)) == ()


def test_a_record_too_short_to_tell_is_not_flagged(composed: Composed) -> None:
    assert found(composed("static_12", "source.duration=10 s", "source.gyro_noise=30 deg/sqrt(h)")) == ()


def test_a_record_without_an_imu_is_refused(composed: Composed) -> None:
    with pytest.raises(DataError, match="monitor 'noise' needs the stream 'imu'"):
        found(composed("static_12"), Record({}))
