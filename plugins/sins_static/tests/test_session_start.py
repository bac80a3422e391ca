"""A session does not guess where it starts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import estimfw
from estimfw.errors import UsageError
from estimfw.run.load import load_record
from estimfw.run.run import run_problem

EXAMPLES = Path(__file__).parents[3] / "examples"
SIMULATED = ["source.duration=90 s", "source.rate=10 Hz", "initial_attitude.yaw=30 deg", "estimator.loop=closed"]
COARSE = "initial_attitude={kind: inertial.inertial_frame, duration: 60 s}"


def test_start_that_an_alignment_has_to_find_is_asked_for() -> None:
    problem = estimfw.open_filter(EXAMPLES / "static_12.yaml", [*SIMULATED, COARSE])
    with pytest.raises(UsageError, match=r"found from a record.*\n.*problem.initial.find\(record\)"):
        estimfw.Session(problem)


def test_session_from_a_found_start_equals_the_batch_run() -> None:
    record = load_record(estimfw.open_filter(EXAMPLES / "static_12.yaml", SIMULATED))
    problem = estimfw.open_filter(EXAMPLES / "static_12.yaml", [*SIMULATED, COARSE])
    batch = run_problem(problem, record=record)
    found = problem.initial.find(record)
    imu = record.streams["imu"]
    session = estimfw.Session(problem, start=found, time=found.time, periods={"imu": 0.1})
    estimate = None
    for time, row in zip(imu.time, imu.values, strict=True):
        if time > found.time + 1e-9:
            estimate = session.push(float(time), row) or estimate
    assert estimate is not None
    assert np.array([value for value, _ in estimate.states.values()]) == pytest.approx(
        batch.estimate[-1], rel=1e-12, abs=1e-15
    )
    assert np.array([sigma for _, sigma in estimate.states.values()]) == pytest.approx(batch.sigma[-1], rel=1e-12)
    assert abs(np.rad2deg(estimate.outputs["attitude.yaw"][0]) - 30.0) < 1.0
