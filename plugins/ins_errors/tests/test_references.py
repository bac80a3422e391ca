"""References: what each reads of the errors, lever arms, and the heading that goes through North."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]
Run = Callable[..., Any]
LETTER = ("source.truth=linear", "source.noise=false", "estimator.loop=open", "source.duration=1 h")
LOG = "measurements={velocity: {kind: ins_errors.doppler_log, stream: doppler_log, noise: 0.05 m/s}}"
#: Tight turns whose ends are rows of the INS, which come every second.
TURNS = (
    "source.interval=1 s",
    "source.duration=200 s",
    "source.turn_rate=6 deg/s",
    "source.legs=[{time: 60 s, course: 195 deg}, {time: 120 s, course: 345 deg}]",
    "process.local_level.terms=complete",
    "estimator.kernel=numpy",
)


def design(problem: Problem, name: str) -> FloatArray:
    plan = problem.plan
    row = plan.layout.complete(plan.layout.pack(problem.reference))
    return next(m for m in plan.measurements if m.name == name).H.evaluate(row)


def test_a_doppler_log_reads_velocity_and_azimuth_error(opened: Open) -> None:
    """In East and North: z_x = dVx - Vy gamma, z_y = dVy + Vx gamma; its rows are those turned into vehicle axes."""
    problem = opened("ins_const11", LOG, "source.course=30 deg", "source.references={velocity: null, doppler_log: {}}")
    Vx, Vy = problem.reference["velocity_t"]
    due = np.zeros((2, 11))
    due[:, 3:5], due[0, 2], due[1, 2] = np.eye(2), -Vy, Vx
    K = np.radians(30.0)
    axes = np.array([[np.cos(K), -np.sin(K)], [np.sin(K), np.cos(K)]])  # right, forward of East, North
    np.testing.assert_allclose(design(problem, "velocity"), axes @ due, rtol=0, atol=1e-12)


def test_a_log_with_equal_noises_gives_the_same_sigmas_in_either_axes(opened: Open, done: Run) -> None:
    """Rows turned together tell the same: the sigma of the log resolved East and North is that of its own axes."""
    own = done("ins_const11", *LETTER, LOG, "source.references={velocity: null, doppler_log: {}}")
    problem = own.problem
    H, R = design(problem, "velocity"), 0.05**2 * np.eye(2)
    K = float(problem.reference["heading"])
    axes = np.array([[np.cos(K), -np.sin(K)], [np.sin(K), np.cos(K)]])
    P = np.asarray(own.run.covariance[-1])
    gained = [h.T @ np.linalg.solve(h @ P @ h.T + R, h) for h in (H, axes.T @ H)]
    np.testing.assert_allclose(gained[0], gained[1], rtol=0, atol=1e-9 * np.max(np.abs(gained[0])))


def test_the_azimuth_error_is_not_read_by_a_log_from_the_forward_speed(opened: Open) -> None:
    problem = opened("ins_const11", LOG, "source.references={velocity: null, doppler_log: {}}")
    right, forward = design(problem, "velocity")[:, 2]
    assert right == pytest.approx(-20.0 * 1852.0 / 3600.0)
    assert forward == pytest.approx(0.0, abs=1e-12)


def test_a_heading_goes_through_north(done: Run) -> None:
    """A course of 0 deg with noise: readings on both sides of North, none gated, the error is found."""
    found = done(
        "ins_const11_heading", "source.course=0 deg", "source.duration=20 min", "estimator.gate=0.9999",
        "source.references={heading: {noise: 30 arcmin}}", "measurements.heading.noise=30 arcmin",
    ).run  # fmt: skip
    headings = found.prepared.record.streams["heading"].values[:, 0]
    assert headings.min() < 0.1 and headings.max() > 6.2
    assert np.all(found.disposition == 0)
    innovation = found.innovation[:, 2]
    assert np.max(np.abs(innovation)) < np.radians(3.0)
    assert abs(np.degrees(found.output_error[-1, 0])) < 4.0 * np.degrees(found.output_sigma[-1, 0])


@pytest.mark.parametrize(("told", "good"), [("[12 m, 30 m]", True), ("[0 m, 0 m]", False)])
def test_a_lever_arm_that_is_told_does_no_harm_in_turns(done: Run, told: str, good: bool) -> None:
    """At 6 deg/s an antenna 32 m away goes 3.4 m/s faster: 68 sigmas."""
    found = done(
        "ins_const11", *TURNS, "source.references={velocity: {lever_arm: [12 m, 30 m]}}",
        f"measurements.velocity.lever_arm={told}",
    ).run  # fmt: skip
    scaled = np.abs(found.innovation) / found.innovation_sigma
    assert (np.max(scaled) < 6.0) == good, np.max(scaled)


@pytest.mark.parametrize("name", ["doppler_log", "position"])
def test_lever_arms_of_log_and_position(done: Run, name: str) -> None:
    noise = {"doppler_log": "0.05 m/s", "position": "[0.0005 arcmin, 0.0007 arcmin]"}[name]
    made = {"doppler_log": "0.05 m/s", "position": "0.927 m"}[name]
    found = done(
        "ins_const11", *TURNS, f"source.references={{velocity: null, {name}: {{noise: {made}, lever_arm: [12 m, 30 m]}}}}",
        f"measurements={{other: {{kind: ins_errors.{name}, stream: {name}, noise: {noise}, lever_arm: [12 m, 30 m]}}}}",
        "blocks.longitude_error={kind: ins_errors.longitude_error, sigma: 0.01 arcmin}",
    ).run  # fmt: skip
    assert np.max(np.abs(found.innovation) / found.innovation_sigma) < 6.0
    assert np.nanmean(found.nis) == pytest.approx(2.0, abs=0.3)


def test_a_position_without_a_longitude_block_reads_the_latitude_alone(opened: Open) -> None:
    position = "measurements.fix={kind: ins_errors.position, noise: 0.003 arcmin}"
    problem = opened("ins_const11", position)
    assert [m.labels for m in problem.plan.measurements if m.name == "fix"] == [("fix[latitude]",)]
    with pytest.raises(ConfigError, match="2 noises for latitude"):
        opened("ins_const11", "measurements.fix={kind: ins_errors.position, noise: [0.003 arcmin, 0.004 arcmin]}")


def test_a_position_needs_a_block_to_read(opened: Open) -> None:
    with pytest.raises(ConfigError, match=r"neither 'lat' nor 'longitude_error' is a block"):
        opened("ins_const11", "measurements.fix={kind: ins_errors.position, noise: 0.003 arcmin, latitude: lat}")


def test_a_bias_block_along_other_axes_is_refused(opened: Open) -> None:
    with pytest.raises(ConfigError, match="none of the axes E, N, U"):
        opened("ins_const11", "blocks.accel_bias.axes=[x, y]")
