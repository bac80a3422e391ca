"""The blocks keep to the convention sheet: errors are INS minus truth, the vertical velocity is held."""

from __future__ import annotations

import numpy as np
from estimfw_ins_errors.blocks import VelocityErrorConfig, velocity_error
from estimfw_ins_errors.errors import longitude_error_of, velocity_error_of

from estimfw.model.build import build_model


def test_the_velocity_error_has_two_living_axes_of_a_triad_with_their_own_prior() -> None:
    cfg = VelocityErrorConfig(kind="ins_errors.velocity_error", sigma=["0.1 m/s", "0.2 m/s"])  # type: ignore[arg-type]
    model = build_model([velocity_error("dV", cfg, None)])
    assert model.states == ("dV[E]", "dV[N]")
    _, covariance = model.prior.evaluate({})
    np.testing.assert_array_equal(covariance, np.diag([0.1**2, 0.2**2]))


def test_errors_are_ins_minus_truth() -> None:
    ins, true = np.array([[10.5, 2.0]]), np.array([[10.0, 2.25]])
    found = velocity_error_of({"velocity_t": ins}, {"velocity_t": true})
    np.testing.assert_array_equal(found, [[0.5, -0.25, 0.0]])


def test_a_longitude_error_goes_the_shorter_way_round() -> None:
    east, west = np.array([np.radians(179.0)]), np.array([np.radians(-179.0)])
    found = longitude_error_of({"longitude": east}, {"longitude": west})
    np.testing.assert_allclose(np.degrees(found), [[-2.0]], atol=1e-12)
