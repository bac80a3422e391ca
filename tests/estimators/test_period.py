"""Readings of an angle that wraps: the innovation is taken the shorter way round, by every recursion."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.estimators.scan import ChunkResult
from estimfw.kernels.fuse import nearest
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare
from estimfw.run.session import Session

Composed = Callable[[str], Problem]
#: A heading that turns with 2 deg/s through North, read every second from 0 to 360 deg.
CONFIG = """
estimfw: 1
blocks:
  heading: {kind: integrated_random_walk, unit: rad, sigma: 10 deg, mean: 351 deg, rate_sigma: 3 deg/s, noise: 0.01 deg/s^1.5}
measurements:
  compass: {kind: direct, of: [{block: heading}], noise: 0.5 deg, period: 360 deg}
estimator: ESTIMATOR
source: {kind: log, streams: {compass: {file: FILE, units: {heading: deg}}}}
"""
KALMAN = [
    "{kind: kalman, kernel: numpy}",
    "{kind: kalman, kernel: numba}",
    "{kind: kalman, kernel: numba, covariance: joseph}",
]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    rows = [f"{t},{(350.0 + 2.0 * t) % 360.0}" for t in range(1, 31)]
    path = tmp_path / "compass.csv"
    path.write_text("\n".join(["time,heading", *rows]) + "\n", encoding="utf-8")
    return path


def outcome(problem: Problem) -> ChunkResult:
    prepared = prepare(problem, load_record(problem))
    return prepared.scan.run(prepared.state, make_chunk(prepared, 0, len(prepared.steps)))[1]


def problem_of(composed: Composed, log: Path, estimator: str, gate: str = "") -> Problem:
    text = CONFIG.replace("ESTIMATOR", f"{estimator[:-1]}{gate}}}").replace("FILE", str(log))
    return composed(text.replace("block: heading}]", "block: heading}], columns: [heading]"))


@pytest.mark.parametrize("estimator", [*KALMAN, "{kind: unscented}", "{kind: unscented, alpha: 0.5}"])
def test_a_heading_goes_through_north_without_a_jump(composed: Composed, log: Path, estimator: str) -> None:
    result = outcome(problem_of(composed, log, estimator, ", gate: 0.999"))
    assert np.all(result.disposition == 0), "a reading behind North was gated"
    assert np.max(np.abs(result.innovation)) < np.radians(4.0)
    np.testing.assert_allclose(np.degrees(result.estimate[-1]), [410.0, 2.0], atol=0.05)


@pytest.mark.parametrize("estimator", [*KALMAN[1:], "{kind: unscented}"])
def test_every_recursion_gives_what_numpy_gives(composed: Composed, log: Path, estimator: str) -> None:
    one, other = (outcome(problem_of(composed, log, which)) for which in (KALMAN[0], estimator))
    np.testing.assert_allclose(other.estimate, one.estimate, rtol=0, atol=1e-10)
    np.testing.assert_allclose(other.innovation, one.innovation, rtol=0, atol=1e-10)


def test_a_session_does_as_the_run(composed: Composed, log: Path) -> None:
    problem = problem_of(composed, log, KALMAN[0])
    whole = outcome(problem)
    session = Session(problem, time=1.0)
    for t in range(1, 31):
        session.measure("compass", float(t), [np.radians((350.0 + 2.0 * t) % 360.0)])
        estimate = session.advance(float(t))
    np.testing.assert_allclose(estimate.states["heading"][0], whole.estimate[-1, 0], rtol=0, atol=1e-12)


def test_without_a_period_the_jump_is_taken_for_a_turn(composed: Composed, log: Path) -> None:
    text = CONFIG.replace(", period: 360 deg", "").replace("ESTIMATOR", KALMAN[0]).replace("FILE", str(log))
    result = outcome(composed(text.replace("block: heading}]", "block: heading}], columns: [heading]")))
    assert np.max(np.abs(result.innovation)) > np.radians(180.0)


@pytest.mark.parametrize("period", ["0 deg", "-360 deg", "3 m"])
def test_a_period_is_a_positive_angle(composed: Composed, log: Path, period: str) -> None:
    text = CONFIG.replace("360 deg}", f"{period}}}").replace("ESTIMATOR", KALMAN[0]).replace("FILE", str(log))
    with pytest.raises(ConfigError, match=period):
        composed(text)


def test_nearest_leaves_what_is_missing_missing() -> None:
    moved = nearest(np.array([359.0, np.nan, 1.0]), np.array([1.0, 1.0, 359.0]), 360.0)
    np.testing.assert_array_equal(moved, [-1.0, np.nan, 361.0])


NODES = "nodes: [{name: angle, blocks: [heading], measurements: [compass]}, {name: rate, blocks: [heading_rate]}]"


@pytest.mark.parametrize("forms", ["", ", cross_covariance: drop"])
def test_nodes_take_the_shorter_way_round(composed: Composed, log: Path, forms: str) -> None:
    """Two nodes, the heading in one and its rate in the other, are the filter in one piece; separate ones do not jump either."""
    result = outcome(problem_of(composed, log, f"{{kind: decentralised, {NODES}{forms}}}"))
    assert np.max(np.abs(result.innovation)) < np.radians(4.0)
    np.testing.assert_allclose(np.degrees(result.estimate[-1, 0]), 410.0, atol=0.3)
    if not forms:
        whole = outcome(problem_of(composed, log, KALMAN[0]))
        np.testing.assert_allclose(result.estimate, whole.estimate, rtol=0, atol=1e-10)
