"""A nominal that changes in steps: its instants are ends of steps, and its segments are those of a filter written out by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError
from estimfw.estimators.numpy_scan import NumpyScan
from estimfw.montecarlo.draw import draw_runs
from estimfw.montecarlo.filtering import filter_runs
from estimfw.report.explain import explain_json
from estimfw.report.segments import segments_of, segments_text
from estimfw.run.from_python import open_filter
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare
from estimfw.run.run import run_problem
from estimfw.run.session import Session

FloatArray = NDArray[np.float64]
Composed = Callable[..., Problem]

CONFIG = """
estimfw: 1
nominal:
  kind: stepped
  steps:
    - {time: 0 s, values: {rate: -0.1, pull: 1.0}}
    - {time: 4.5 s, values: {rate: 0.3, pull: 1.0}}
    - {time: 8 s, values: {rate: -0.1, pull: 1.0}}
blocks:
  x: {kind: random_constant, unit: m, sigma: 2 m}
  b: {kind: random_walk, unit: m/s, sigma: 1 m/s, noise: 0.2 m/s/sqrt(s)}
process:
  growth: {kind: couple, target: x, source: x, coefficient: {scalar: rate}}
  push: {kind: couple, target: x, source: b, coefficient: {scalar: pull}}
measurements:
  fix: {kind: direct, of: [{block: x}], noise: 0.5 m}
"""
#: What F is, and until when.
SEGMENTS = ((4.5, -0.1), (8.0, 0.3), (12.0, -0.1))


@pytest.fixture
def composed(tmp_path: Path) -> Composed:
    def make(*overrides: str, text: str = CONFIG) -> Problem:
        path = tmp_path / "filter.yaml"
        path.write_text(text)
        return open_filter(path, overrides)

    return make


def record() -> Record:
    """A fix each second from 1 s to 12 s; the filter starts at 0 s."""
    time = np.arange(1.0, 13.0)
    values = np.random.default_rng(3).standard_normal((time.size, 1))
    return Record({"fix": Stream("fix", time, values, ("fix",), "sample", 1.0)}, initial={"time": np.array(0.0)})


def by_hand() -> tuple[FloatArray, FloatArray]:
    """Estimates (12, 2) and covariances after the fixes, each interval cut where the rate changes."""
    x, P, D = np.zeros(2), np.diag([4.0, 1.0]), np.diag([0.0, 0.04])
    H, at = np.array([[1.0, 0.0]]), 0.0
    estimates, covariances = [], []
    for time, (reading,) in zip(record().streams["fix"].time, record().streams["fix"].values, strict=True):
        for until, rate in SEGMENTS:
            if (dt := min(time, until) - at) > 0.0:
                F = np.array([[rate, 1.0], [0.0, 0.0]])
                big = expm(np.block([[-F, D], [np.zeros((2, 2)), F.T]]) * dt)
                Phi = big[2:, 2:].T
                x, P, at = Phi @ x, Phi @ P @ Phi.T + Phi @ big[:2, 2:], at + dt
        S = H @ P @ H.T + 0.25
        K = P @ H.T / S
        x, P = x + K[:, 0] * (reading - H @ x), P - K @ H @ P
        estimates.append(x)
        covariances.append(P)
    return np.array(estimates), np.array(covariances)


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_estimates_are_those_of_a_filter_whose_intervals_are_cut_where_the_nominal_changes(
    composed: Composed, kernel: str
) -> None:
    done = run_problem(composed(f"estimator={{kind: kalman, kernel: {kernel}}}"), record=record())
    assert done.prepared.steps.time.tolist() == [1, 2, 3, 4, 4.5, 5, 6, 7, 8, 9, 10, 11, 12]
    x, P = by_hand()
    at_fixes = np.isin(done.prepared.steps.time, record().streams["fix"].time)
    np.testing.assert_allclose(done.estimate[at_fixes], x, rtol=1e-11)
    np.testing.assert_allclose(done.sigma[at_fixes], np.sqrt(np.einsum("kii->ki", P)), rtol=1e-11)


def test_a_session_stops_where_the_nominal_changes(composed: Composed) -> None:
    session = Session(composed())
    for time, values in zip(record().streams["fix"].time, record().streams["fix"].values, strict=True):
        session.measure("fix", time, values)
        made = session.advance(time)
    x, P = by_hand()
    np.testing.assert_allclose([made.states["x"][0], made.states["b"][0]], x[-1], rtol=1e-11)
    np.testing.assert_allclose(made.covariance, P[-1], rtol=1e-11)


def test_equal_segments_share_their_matrices(composed: Composed) -> None:
    """Three segments, of which the last is as the first; 0.5 s before and after 4.5 s, and 1 s: four sets for 13 steps."""
    problem = composed()
    assert problem.plan.pace == "stepped" and not problem.plan.steady
    prepared = prepare(problem, record())
    assert isinstance(prepared.scan, NumpyScan)
    prepared.scan.run(prepared.state, make_chunk(prepared, 0, 13))
    assert sorted(dt for dt, _ in prepared.scan.tables) == [0.5, 0.5, 1.0, 1.0]


def test_matrices_of_many_steps_at_once_are_those_of_each(composed: Composed) -> None:
    prepared = prepare(composed(), record())
    chunk, plan = make_chunk(prepared, 0, 13), prepared.plan
    together = plan.transitions(chunk.samples, chunk.inputs, chunk.dt, prepared.scan.doublings)
    for k in range(13):
        own = slice(k, k + 1)
        alone = plan.transitions(chunk.samples[own], chunk.inputs[own], chunk.dt[own], prepared.scan.doublings)
        for one, all_ in zip(alone, together, strict=True):
            np.testing.assert_array_equal(one[0], all_[k])


def test_one_step_is_a_constant(composed: Composed) -> None:
    problem = composed("nominal.steps=[{values: {rate: -0.1, pull: 1.0}}]")
    assert problem.plan.time_invariant
    assert prepare(problem, record()).bound is None


@pytest.mark.parametrize(
    ("steps", "told"),
    [
        (
            "[{time: 3 s, values: {rate: 1, pull: 1}}, {time: 2 s, values: {rate: 2, pull: 1}}]",
            "do not follow each other",
        ),
        ("[{values: {rate: 1, pull: 1}}, {time: 2 s, values: {rate: 2}}]", "the step at 2 s has other variables"),
    ],
)
def test_steps_out_of_order_or_unlike_are_refused(composed: Composed, steps: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        composed(f"nominal.steps={steps}")


def test_a_simulated_record_follows_the_schedule(composed: Composed) -> None:
    """Without noise the truth grows and shrinks at the rates of the segments."""
    source = "source={kind: simulate_model, duration: 12 s, rate: 1 Hz, noise: false}"
    problem = composed(source, "blocks.x.mean=1 m")
    truth = load_record(problem).truth
    assert truth is not None
    time, x = truth.time, truth.values["state:x"]
    growth = -0.1 * np.minimum(time, 4.5) + 0.3 * np.clip(time - 4.5, 0.0, 3.5) - 0.1 * np.maximum(time - 8.0, 0.0)
    np.testing.assert_allclose(x, np.exp(growth), rtol=1e-12)


def test_monte_carlo_errors_are_those_that_the_filter_says(composed: Composed) -> None:
    """300 runs over all three segments: mean NEES within four of its standard deviations."""
    problem = composed("source={kind: simulate_model, duration: 12 s, rate: 1 Hz}")
    draws = draw_runs(problem, 5, range(300))
    steps = prepare(problem, draws.run(0)).steps
    done = filter_runs(problem, draws, np.array([5, len(steps) - 1]), 300, [str(i) for i in range(300)])
    assert draws.truth is not None
    at = np.searchsorted(draws.time, steps.time[[5, len(steps) - 1]])
    truth = np.stack([draws.truth[f"state:{name}"][:, at] for name in ("x", "b")], axis=-1)
    error = done.estimate - truth
    nees = np.einsum("rgi,rgij,rgj->rg", error, np.linalg.inv(done.covariance), error)
    assert np.all(np.abs(nees.mean(axis=0) - 2.0) < 4.0 * 2.0 / np.sqrt(300))


def test_explain_tells_the_segments(composed: Composed, tmp_path: Path) -> None:
    problem = composed()
    assert segments_text(segments_of(problem)) == (
        "3 segments, 2 sets of matrices: a from the start, b from 4.5 s, a from 8 s"
    )
    assert [s["from"] for s in explain_json(problem)["segments"]] == [None, 4.5, 8.0]
    assert len(segments_of(composed("nominal.steps=[{values: {rate: -0.1, pull: 1.0}}]"))) == 1


def test_a_target_that_turns_at_known_times(example: Callable[..., Problem]) -> None:
    """The example: told of the turn, the filter is consistent; the one that is not told is far off."""
    problem = example("tracker_turns")
    assert segments_text(segments_of(problem)).startswith("3 segments, 2 sets of matrices")
    done = run_problem(problem)
    assert 80.25 in done.prepared.steps.time and done.truth is not None
    assert np.all(np.abs(done.estimate - done.truth) < 4.5 * done.sigma)
    blind = example("tracker_turns", "nominal.steps=[{values: {turn: [[0, 0], [0, 0]]}}]")
    lost = run_problem(blind, record=done.prepared.record)
    assert np.nanmean(done.nis) < 3.0 and np.nanmean(lost.nis) > 10.0
