"""Alignment by estimation: an ordinary closed-loop filter over an ordinary config."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.rotation import attitude_matrix
from numpy.typing import NDArray

from estimfw.data.record import Record
from estimfw.run.run import Collected, run_problem
from estimfw.testing import check_draws, check_measurements, check_outputs, check_provider

FloatArray = NDArray[np.float64]

PERFECT = ("preprocess={}", "source.errors=false", "source.speed=exact")


def end_error(done: Collected) -> FloatArray:
    """Errors of yaw, pitch, roll at the end, deg."""
    assert done.output_error is not None
    return np.asarray(np.degrees(done.output_error[-1, :3]))


def true_heading(record: Record) -> float:
    """At the start, deg."""
    assert record.truth is not None
    C = record.truth.values["C_bn"][0]
    return float(np.degrees(np.arctan2(C[0, 1], C[1, 1])))


def test_the_provider_keeps_the_contract_compiled_and_plain(one_start: Any) -> None:
    problem = one_start("source.duration=20 s", "nominal.lever_arm=[0.3 m, -1 m, 0.2 m]")
    check_provider(problem)
    check_outputs(problem)
    check_measurements(problem)
    check_draws(problem)


@pytest.mark.parametrize(("seed", "off"), [(1, -22.5), (2, 22.5)])
def test_a_perfect_drive_is_aligned_to_the_third_of_a_minute_from_the_nearest_start(
    one_start: Any, drive: Any, seed: int, off: float
) -> None:
    """A bank of eight has one that is no further off than 22.5 deg; the rest is the latitude, held at that of the start."""
    start = f"initial_attitude.heading={true_heading(drive(seed=seed)) + off} deg"
    yaw, pitch, roll = np.abs(end_error(run_problem(one_start(*PERFECT, f"source.seed={seed}", start))))
    assert yaw < 0.03 and max(pitch, roll) < 0.002


def test_numpy_and_compiled_filters_give_the_same_attitude(one_start: Any) -> None:
    short = ("source.duration=120 s", "initial_attitude.heading=100 deg")
    plain, compiled = (run_problem(one_start(*short, f"estimator.kernel={k}")) for k in ("numpy", "numba"))
    assert compiled.output == pytest.approx(plain.output, abs=1e-9)
    assert compiled.output_sigma == pytest.approx(plain.output_sigma, rel=1e-7)


def test_the_ud_form_gives_the_same_attitude(one_start: Any) -> None:
    short = ("source.duration=120 s", "initial_attitude.heading=100 deg")
    joseph, ud = (run_problem(one_start(*short, f"estimator.covariance={k}")) for k in ("joseph", "ud"))
    assert ud.output == pytest.approx(joseph.output, abs=1e-7)


def test_the_literal_filter_is_the_full_one_without_its_other_blocks(one_start: Any) -> None:
    drop = "policies=[{kind: drop_states, states: [gyro_bias, accel_bias, initial_speed_error]}]"
    done = run_problem(one_start("source.duration=200 s", drop))
    assert done.prepared.plan.states == ("attitude_error[x]", "attitude_error[y]", "attitude_error[z]")
    assert np.all(np.isfinite(done.output_sigma))


def test_without_the_transport_rate_the_provider_drops_it_too(one_start: Any) -> None:
    problem = one_start("policies=[{kind: drop_term, terms: [transport_rate]}]")
    (check,) = problem.checks
    assert not check.computed and check.equivalent


def test_a_lever_arm_that_is_not_told_costs_heading(one_start: Any, drive: Any) -> None:
    arm = "source.lever_arm=[2 m, -1 m, 0 m]"
    start = f"initial_attitude.heading={true_heading(drive(seed=1))} deg"
    told = run_problem(one_start(*PERFECT, arm, "nominal.lever_arm=[2 m, -1 m, 0 m]", start))
    silent = run_problem(one_start(*PERFECT, arm, start))
    assert abs(end_error(told)[0]) < 0.03
    assert np.sum(np.square(silent.nis)) > 100.0 * np.sum(np.square(told.nis))


def test_a_mounted_imu_is_turned_into_the_vehicle(one_start: Any, drive: Any) -> None:
    """The increments of an IMU that sits turned, with the turn in the config, give what those of a straight one do."""
    record, turned = drive(seed=1, duration="120 s"), attitude_matrix(0.3, -0.1, 0.2)
    stream = record.streams["imu"]
    values = stream.values.copy()
    values[:, :3], values[:, 3:6] = values[:, :3] @ turned, values[:, 3:6] @ turned
    mounted = replace(record, streams={"imu": replace(stream, values=values)})
    angles = "{yaw: 0.3 rad, pitch: -0.1 rad, roll: 0.2 rad}"
    mount = (f"nominal.mounting={angles}", f"initial_attitude.mounting={angles}")
    straight, back = (
        run_problem(one_start(*PERFECT, "source.duration=120 s", *more), record=r)
        for more, r in (((), record), (mount, mounted))
    )
    assert back.output == pytest.approx(straight.output, abs=1e-8)


@pytest.mark.parametrize("seed", [1, 5])
def test_a_bank_needs_no_heading(opened: Any, seed: int) -> None:
    done = run_problem(opened("odometer_aeba.yaml", *PERFECT, f"source.seed={seed}"))
    assert end_error(done) == pytest.approx(np.zeros(3), abs=0.03)
