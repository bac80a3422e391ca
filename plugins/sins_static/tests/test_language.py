"""Models that prove the language: an anisotropic IMU, a swaying base, a measurement over two blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem

FloatArray = NDArray[np.float64]
Compose = Callable[..., Problem]

IN_N = "policies=[sins_static.constant_specific_force, sins_static.bias_in_navigation_frame]"
TILTED = ("initial_attitude.yaw=130 deg", "initial_attitude.pitch=20 deg", "initial_attitude.roll=-35 deg")
ONE_AXIS = "process.phi_angle.gyro_noise=[0.001 deg/sqrt(h), 0.001 deg/sqrt(h), 0.004 deg/sqrt(h)]"
SWAY = ("source.sway.amplitude=[0.5 deg, 1 deg, 2 deg]", "source.sway.period=7 s")
SERIES = tuple(f"estimator.discretisation.{name}=4" for name in ("phi_order", "q_order"))
GYRO_SIGMA = 0.01 * np.pi / 180.0 / 3600.0


# -- an anisotropic IMU ------------------------------------------------------------------------------------------------


def test_an_anisotropic_gyro_keeps_the_noise_on_the_attitude(composed: Compose) -> None:
    """Re-framed biases make F constant; one noisy gyro axis still turns with the body."""
    isotropic, anisotropic = composed("static_12", IN_N, *TILTED), composed("static_12", IN_N, ONE_AXIS, *TILTED)
    assert isotropic.plan.time_invariant
    assert "C_bn" not in anisotropic.model.F.coefficient.needs
    assert anisotropic.model.diffusion.needs == {"C_bn"}
    assert anisotropic.plan.reason == "gyro_noise_coupling needs C_bn, which is varying"


def test_its_diffusion_is_the_rotated_one(composed: Compose) -> None:
    problem = composed("static_12", IN_N, ONE_AXIS, *TILTED)
    R, arw = problem.reference["C_bn"], np.pi / 180.0 / 60.0
    wanted = R @ np.diag(np.square(arw * np.array([0.001, 0.001, 0.004]))) @ R.T
    D = problem.model.diffusion.evaluate(problem.reference)
    assert np.allclose(D[3:6, 3:6], wanted, rtol=1e-12, atol=1e-26)
    assert not D[3:6, 0:3].any()


def test_the_seven_states_with_it_vary_in_time_but_have_the_same_F(composed: Compose) -> None:
    isotropic, anisotropic = composed("static_7", *TILTED), composed("static_7", ONE_AXIS, *TILTED)
    assert anisotropic.model.F == isotropic.model.F
    assert not anisotropic.plan.time_invariant


# -- a swaying base ----------------------------------------------------------------------------------------------------


def frame_changes(*blocks: str) -> str:
    steps = [f"{{kind: express_in_frame, block: {b}, frame: n}}" for b in blocks]
    return f"policies=[{', '.join(steps)}]"


def test_biases_in_n_drift_on_a_swaying_base_and_the_change_says_by_how_much(composed: Compose) -> None:
    """Against the sway itself: how far the body's constant moves in n, per sigma, never more and not much less than said."""
    problem = composed("static_12", IN_N, *SWAY, "source.rate=10 Hz", "source.duration=70 s")
    change = problem.changes[1]
    assert change.kind == "approximate"
    said = {m.name: m.value for m in change.measures}
    C_bn = problem.source.load().truth.values["C_bn"]
    direction = np.linalg.svd(C_bn[20] - C_bn[0])[2][0]  # a bias along the axis that moves most
    moved = C_bn @ (GYRO_SIGMA * direction)
    spread = np.linalg.norm(moved[:, None] - moved[None], axis=-1).max()
    assert 0.5 * said["drift of gyro_bias"] < spread <= said["drift of gyro_bias"]
    assert said["drift of accel_bias"] / said["drift of gyro_bias"] == pytest.approx(
        100e-6 * 9.80665 / GYRO_SIGMA, rel=1e-12
    )
    turned = "b and n turn by at most 4.58 deg against each other: what is constant in b drifts in n"
    assert change.condition == turned  # twice the length of the amplitude
    told = change.as_json()
    assert str(told["text"]).startswith(turned)
    assert told["steps"] == [step.as_json() for step in change.steps]


def test_a_base_at_rest_pays_nothing(composed: Compose) -> None:
    change = composed("static_12", IN_N).changes[1]
    assert change.kind == "exact"
    assert change.condition.endswith("b and n do not turn against each other: what is constant in b is constant in n")


def test_a_record_of_unknown_motion_is_priced_by_the_degree(composed: Compose) -> None:
    problem = composed("lasergyro_12", IN_N, "source.file=nowhere.imu")
    change = problem.changes[1]
    assert change.kind == "approximate"
    assert change.measures[1].name == "drift of gyro_bias per degree of turn"
    assert change.condition == "right if b and n do not turn against each other, which only the record can tell"


def test_the_rotation_stays_as_a_term_unless_it_is_dropped(composed: Compose) -> None:
    problem = composed("static_12", frame_changes("accel_bias", "gyro_bias"), *SWAY)
    labels = [t.label for t in problem.model.terms]
    assert "gyro_bias.frame_rotation" in labels
    assert "accel_bias.frame_rotation" in labels
    assert "gyro_bias.frame_rotation needs omega_nb_n, which is varying" in problem.plan.reason
    assert "accel_bias.frame_rotation" not in [t.label for t in composed("static_12", IN_N, *SWAY).model.terms]


def test_with_the_rotation_kept_the_frame_of_the_biases_makes_no_difference(ran: Callable[..., Any]) -> None:
    """Biases in b, or in n turning with b: one estimate and one sigma but for the step, far below what dropping it does."""
    settings = (*SWAY, *SERIES, "source.noise=false", "source.duration=21 s")

    def end(policies: str, rate: int) -> FloatArray:
        done = ran("static_12", policies, f"source.rate={rate} Hz", *settings)
        return np.concatenate([done.output[-1, :3], done.output_sigma[-1, :3]])

    in_b, in_n = "policies=[]", frame_changes("accel_bias", "gyro_bias")
    coarse, fine = (np.abs(end(in_n, rate) - end(in_b, rate)).max() for rate in (5, 10))
    dropped = np.abs(end("policies=[sins_static.bias_in_navigation_frame]", 10) - end(in_b, 10)).max()
    assert fine < 0.5 * coarse
    assert fine < 1e-4 * dropped


# -- a measurement over two blocks -------------------------------------------------------------------------------------

READ_BOTH = (
    "measurements.shaken={kind: direct, noise: 0.01 m/s, rows: [x, y, z], of: [{block: velocity_error}, "
    "{block: gyro_bias, coefficient: [[0, 2, 0], [-2, 0, 0], [0, 0, 1]]}]}"
)


def test_a_measurement_reads_two_blocks_and_follows_one_into_another_frame(composed: Compose) -> None:
    before = composed("static_12", "policies=[]", READ_BOTH, *TILTED)
    after = composed("static_12", frame_changes("gyro_bias"), READ_BOTH, *TILTED)
    lever = np.array([[0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    H = np.hstack([np.eye(3), np.zeros((3, 6)), lever])
    assert np.array_equal(before.model.H("shaken").coefficient.evaluate(before.reference), H)
    R = after.reference["C_bn"]
    H[:, 9:] = lever @ R.T
    assert np.allclose(after.model.H("shaken").coefficient.evaluate(after.reference), H, atol=1e-15)
    assert "measurement shaken needs C_bn, which is varying" in after.plan.reason
