"""A start that was found with biased sensors is correlated with the states that are those biases."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from estimfw import open_filter
from estimfw.run.load import load_record
from estimfw.run.prepare import Prepared, prepare

STATIC = Path(__file__).parents[2] / "examples" / "static_12.yaml"
IN_NAVIGATION_FRAME = "policies=[sins_static.remove_coriolis, sins_static.bias_in_navigation_frame]"
SEVEN = (
    "policies=[sins_static.remove_coriolis, sins_static.bias_in_navigation_frame, sins_static.remove_vertical_channel, "
    "{kind: sins_static.prune_unobservable, protect: [attitude_error]}]"
)
TEN = (
    "policies=[sins_static.constant_specific_force, sins_static.remove_coriolis, sins_static.bias_in_navigation_frame, "
    "sins_static.remove_vertical_channel]"
)
TURN = Rotation.from_euler("ZXY", [25.0, 4.0, -6.0], degrees=True).as_matrix()
UG = 9.80665e-6


def prepared(*overrides: str, kind: str = "inertial_frame", true: dict[str, Any] | None = None) -> Prepared:
    """A standing vehicle at yaw 25, pitch 4, roll -6 deg, aligned by 60 s of error-free samples, with the given biases."""
    start = f"initial_attitude={{kind: inertial.{kind}, duration: 60 s, accel_bias: 50 ug, gyro_bias: 0.02 deg/h}}"
    common = ["source.noise=false", "source.rate=10 Hz", "source.duration=70 s"]
    biases = {"accel_bias": [0.0] * 3, "gyro_bias": [0.0] * 3} | (true or {})
    units = {"accel_bias": "m/s^2", "gyro_bias": "rad/s"}
    given = [f"source.{n}=[{', '.join(f'{float(x)!r} {units[n]}' for x in v)}]" for n, v in biases.items()]
    simulated = open_filter(STATIC, [*common, *given, *(f"initial_attitude.{n}={a} deg" for n, a in ANGLES)])
    problem = open_filter(STATIC, [*common, *given, start, *overrides])
    return prepare(problem, load_record(simulated))


ANGLES = (("yaw", 25), ("pitch", 4), ("roll", -6))


def phi(one: Prepared) -> np.ndarray:
    """The attitude error of the found start, against the truth."""
    return -Rotation.from_matrix(np.asarray(one.start.values["C_bn"]) @ TURN.T).as_rotvec()


def sensitivity(kind: str, quantity: str, size: float) -> np.ndarray:
    """By differences: what a bias of each axis does to the found attitude."""
    ends = [
        [phi(prepared(kind=kind, true={quantity: list(sign * size * axis)})) for sign in (1, -1)] for axis in np.eye(3)
    ]
    return np.stack([(up - down) / (2.0 * size) for up, down in ends], axis=1)


def block(one: Prepared, row: str, column: str) -> np.ndarray:
    places = [[i for i, s in enumerate(one.plan.states) if s.startswith(name)] for name in (row, column)]
    return one.prior[1][np.ix_(*places)]


@pytest.mark.parametrize("kind", ["inertial_frame", "averaging"])
@pytest.mark.parametrize(("quantity", "size", "sigma"), [("accel_bias", 1e-3, 100 * UG), ("gyro_bias", 1e-8, 4.848e-8)])
def test_attitude_and_bias_are_correlated_as_differences_say(
    kind: str, quantity: str, size: float, sigma: float
) -> None:
    expected = sensitivity(kind, quantity, size) * sigma**2
    found = block(prepared(kind=kind), "attitude_error", quantity)
    assert np.max(np.abs(found - expected)) < 0.01 * np.max(np.abs(expected))


def test_attitude_takes_over_the_biases_sigma_of_the_filter() -> None:
    """Level: bias / g; the coarse alignment assumed 50 ug, the filter says 100 ug."""
    level = np.sqrt(np.diag(block(prepared(), "attitude_error", "attitude_error")))[:2]
    assert level == pytest.approx(100 * UG / 9.796, rel=0.01)


def test_prior_stays_a_covariance() -> None:
    covariance = prepared().prior[1]
    scale = np.sqrt(np.diag(covariance))
    assert np.linalg.eigvalsh(covariance / np.outer(scale, scale))[0] > -1e-12


def test_biases_in_n_are_correlated_through_the_found_attitude() -> None:
    body, turned = prepared(), prepared(IN_NAVIGATION_FRAME)
    found = np.asarray(body.start.values["C_bn"])
    expected = block(body, "attitude_error", "accel_bias") @ found.T
    assert block(turned, "attitude_error", "accel_bias") == pytest.approx(expected, rel=1e-9, abs=1e-18)


def test_share_of_a_deleted_bias_stays_as_the_alignment_assumed_it() -> None:
    """The 7-state model has no accelerometer bias: its level sigma keeps the 50 ug."""
    seven = prepared(SEVEN)
    assert "accel_bias[E]" not in seven.plan.states
    assert np.sqrt(block(seven, "attitude_error[E]", "attitude_error[E]")[0, 0]) == pytest.approx(
        50 * UG / 9.796, rel=0.02
    )


def test_level_cannot_get_better_than_the_bias_that_made_it() -> None:
    """Whatever the filter does after it, an accelerometer bias of 100 ug stays 0.0057 deg of tilt."""
    from estimfw import run_filter

    one = prepared("policies=[]")
    result = run_filter(one.problem, one.record)
    sigma = np.rad2deg(result["output_sigma"].sel(output="attitude.pitch").to_numpy()[-1])
    assert sigma > 0.0056


def test_attitude_in_another_frame_has_the_found_covariance_turned_into_it() -> None:
    plain = prepared("policies=[]")
    turned = prepared("policies=[{kind: express_in_frame, block: attitude_error, frame: b}]")
    C = np.asarray(plain.start.values["C_bn"])
    for other in ("accel_bias", "gyro_bias", "velocity_error"):
        expected = C.T @ block(plain, "attitude_error", other)
        assert block(turned, "attitude_error", other) == pytest.approx(expected, rel=1e-9, abs=1e-18)
    expected = C.T @ block(plain, "attitude_error", "attitude_error") @ C
    assert block(turned, "attitude_error", "attitude_error") == pytest.approx(expected, rel=1e-9, abs=1e-18)


def test_a_quotient_gets_the_combination_of_what_was_found() -> None:
    """A found level and the accelerometer bias that it is wrong by cancel in phi_E + a_N / g, which the filter then knows."""
    ten, seven = (
        prepared(TEN),
        prepared(TEN.removesuffix("]") + ", {kind: sins_static.prune_unobservable, mode: quotient}]"),
    )
    quotient = seven.problem.model.quotient
    assert quotient is not None
    expected = quotient.T @ ten.prior[1] @ quotient.T.T
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(seven.prior[1] / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-12)
    east = seven.plan.states.index("attitude_error[E]")
    assert scale[east] < 0.1 * np.sqrt(ten.prior[1][ten.plan.states.index("attitude_error[E]")].max())
