"""The two steps of the paper on a recorded INS: what they claim, what is true, and that a filter that considers is honest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw import open_filter
from estimfw.run.run import Collected, run_problem

EXAMPLES = Path(__file__).parents[3] / "examples"


def run(name: str, *overrides: str) -> Collected:
    return run_problem(open_filter(EXAMPLES / f"{name}.yaml", overrides))


def ratio(done: Collected) -> NDArray[np.float64]:
    """Honest over claimed sigma at the end, of attitude and varying drift."""
    assert done.honest is not None
    own = [0, 1, 2, 11, 12, 13]
    return np.asarray(done.honest.sigma[-1, own] / done.sigma[-1, own])


def test_constants_by_velocity_then_drifts_with_heading_claim_too_much() -> None:
    """Tilt 12.3 and vertical drift 3.9 as published; azimuth 4.6 where 3.8 is published, which no truth gives that was tried:
    drifts that begin at their sigma, at zero, or with the second step, with and without what the first step leaves."""
    found = ratio(run("ins_staged"))
    assert found[:2] == pytest.approx([12.3, 12.3], abs=0.05)
    assert found[2] == pytest.approx(4.64, abs=0.02)
    assert found[5] == pytest.approx(3.86, abs=0.02)


def test_heading_in_the_first_step_too_helps_the_azimuth_and_not_the_tilt() -> None:
    """Published are 1.5 (azimuth) and 1.6 (vertical drift)."""
    found = ratio(run("ins_staged", "estimator.stages[0].measurements=[velocity, heading]"))
    assert found[:2] == pytest.approx([12.3, 12.3], abs=0.05)
    assert found[2] == pytest.approx(2.03, abs=0.02)
    assert found[5] == pytest.approx(1.84, abs=0.02)


def test_a_filter_that_considers_the_rest_claims_what_is_true_between_belief_and_all_states_at_once() -> None:
    done, believed = run("ins_staged_considered"), run("ins_staged")
    best = run("ins_staged", "estimator.stages=[{name: a, until: 1 h, measurements: [velocity]}, {name: b}]")
    assert done.honest is not None and believed.honest is not None
    np.testing.assert_allclose(done.honest.sigma, done.sigma, rtol=1e-5)
    azimuth = [float(one[-1, 2]) for one in (best.sigma, done.sigma, believed.honest.sigma)]
    assert azimuth == sorted(azimuth) and azimuth[2] > 2.0 * azimuth[1]
    assert np.all(done.sigma[-1] >= best.sigma[-1] * (1.0 - 1e-9))
