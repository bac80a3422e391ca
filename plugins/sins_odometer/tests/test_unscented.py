"""Alignment by estimation as an unscented filter: the same attitude as by the multiplicative one, on the same drives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimfw.run.load import load_record
from estimfw.run.run import run_problem
from estimfw.testing import check_jacobians, check_provider


def test_h_is_the_derivative_of_the_predicted_velocity_on_the_rotations(one_start: Any) -> None:
    problem = one_start("source.duration=20 s", "nominal.lever_arm=[0.3 m, -1 m, 0.2 m]")
    check_provider(problem)
    check_jacobians(problem, tolerance=1e-8)


@pytest.mark.parametrize(("seed", "off"), [(1, 22.5), (2, -22.5)])
def test_multiplicative_and_unscented_filter_agree_within_their_sigma(one_start: Any, seed: int, off: float) -> None:
    """From the start that is nearest in a bank of eight, at its farthest."""
    short = ["source.duration=300 s", f"source.seed={seed}"]
    truth = load_record(one_start(*short)).truth
    assert truth is not None
    C = truth.values["C_bn"][0]
    short.append(f"initial_attitude.heading={np.degrees(np.arctan2(C[0, 1], C[1, 1])) + off} deg")
    extended, unscented = (
        run_problem(one_start(*short, f"estimator={{kind: {kind}, loop: closed}}")) for kind in ("kalman", "unscented")
    )
    apart = np.mod(unscented.output[:, :3] - extended.output[:, :3] + np.pi, 2.0 * np.pi) - np.pi
    of_sigma = np.abs(apart) / extended.output_sigma[:, :3]
    assert np.max(of_sigma) < 0.3
    np.testing.assert_allclose(unscented.output_sigma[-1, :3], extended.output_sigma[-1, :3], rtol=0.02)
