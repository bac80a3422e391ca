"""Each measurement of a run has its disposition, with NIS and threshold; and numbers that make no sense stop it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import chi2

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import DataError, NumericalError
from estimfw.run.dataset import result_dataset
from estimfw.run.run import Collected, run_problem
from estimfw.run.summary import events_of, measurement_summaries

Composed = Callable[[str], Problem]
KERNELS = ["numpy", "numba"]
FUSED, GATED, _, MISSING, INVALID = range(5)


def filter_text(kernel: str, more: str = "", covariance: str = "ud", noise: str = "1 m", sigma: str = "2 m") -> str:
    return (
        f"estimfw: 1\nblocks: {{p: {{kind: random_walk, unit: m, axes: [x, y], sigma: {sigma}, noise: 0.1 m/sqrt(s)}}}}\n"
        f"measurements: {{fix: {{kind: direct, of: [{{block: p}}], noise: {noise}{more}}}}}\n"
        f"estimator: {{kind: kalman, gate: 0.999, kernel: {kernel}, covariance: {covariance}}}\n"
    )


def run(
    problem: Problem, rows: list[list[float]], name: str = "fix", columns: tuple[str, ...] = ("x", "y")
) -> Collected:
    time = np.arange(1.0, len(rows) + 1.0)
    return run_problem(
        problem,
        record=Record(
            {name: Stream(name, time, np.array(rows), columns, "sample", 1.0)}, initial={"time": np.array(0.0)}
        ),
    )


@pytest.mark.parametrize("kernel", KERNELS)
def test_one_run_with_a_row_of_each_kind(composed: Composed, kernel: str) -> None:
    nan = np.nan
    rows = [[0.1, 0.2], [nan, 0.3], [nan, nan], [0.2, 50.0], [np.inf, 0.1], [0.0, 0.1]]
    result = run(composed(filter_text(kernel)), rows)
    assert result.disposition[:, 0].tolist() == [FUSED, FUSED, MISSING, GATED, FUSED, FUSED]
    assert result.used[:, 0].tolist() == [2, 1, 0, 0, 1, 2]
    # A lost component leaves its state as predicted; the other one is fused by the scalar formula.
    assert result.estimate[1, 0] == result.estimate[0, 0]
    assert result.sigma[1, 0] == pytest.approx(np.hypot(result.sigma[0, 0], 0.1), rel=1e-12)
    variance = result.sigma[0, 1] ** 2 + 0.01
    assert result.sigma[1, 1] == pytest.approx(np.sqrt(variance / (variance + 1.0)), rel=1e-12)
    # A gated one changes nothing, and says by how much it was out.
    np.testing.assert_array_equal(result.estimate[3], result.estimate[2])
    assert result.nis[3, 0] > chi2.ppf(0.999, 2)
    assert np.isnan(result.nis[2, 0])
    (summary,) = measurement_summaries(result_dataset(result))
    assert summary.counts == {"fused": 4, "gated": 1, "late": 0, "missing": 1, "invalid": 0}
    assert result_dataset(result)["fix_disposition"].attrs["threshold"] == pytest.approx(chi2.ppf(0.999, 2))
    kinds = {e.kind: e for e in events_of(result_dataset(result))}
    assert kinds["gated"].time == 4.0 and kinds["gated"].source == "fix"
    assert (kinds["missing"].time, kinds["missing"].count) == (2.0, 3)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("covariance", ["ud", "joseph"])
def test_a_singular_innovation_covariance_is_flagged_and_skipped(
    composed: Composed, kernel: str, covariance: str
) -> None:
    more = ", rows: [a, b], unit: m, perfect: true"
    text = filter_text(kernel, more, covariance, noise="0 m").replace(
        "of: [{block: p}]", "of: [{block: p, coefficient: [[1, 1], [1, 1]]}]"
    )
    result = run(composed(text), [[0.1, 0.2], [0.3, 0.1]], columns=("a", "b"))
    assert result.disposition[:, 0].tolist() == [INVALID, INVALID]
    np.testing.assert_array_equal(result.estimate, 0.0)
    np.testing.assert_allclose(result.sigma[1], np.sqrt(4.0 + 2 * 0.01), rtol=1e-12)
    assert {e.kind for e in events_of(result_dataset(result))} >= {"invalid"}


@pytest.mark.parametrize("kernel", KERNELS)
def test_ud_stays_positive_under_two_tiny_r_and_a_huge_p(composed: Composed, kernel: str) -> None:
    text = (
        filter_text(kernel, noise="1e-6 m", sigma="1e6 m")
        .replace("gate: 0.999, ", "")
        .replace("of: [{block: p}]", "rows: [a, b], unit: m, of: [{block: p, coefficient: [[1, 0.7], [1, 0.7]]}]")
    )
    result = run(composed(text), [[3.0, 3.0]] * 3, columns=("a", "b"))
    assert np.all(result.disposition == FUSED)
    for P in result.covariance:
        assert np.linalg.eigvalsh(P)[0] >= -1e-15 * np.trace(P)
    assert result.estimate[-1] @ [1.0, 0.7] == pytest.approx(3.0, abs=1e-5)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("covariance", ["ud", "joseph"])
def test_overflow_stops_the_run_with_step_and_state(composed: Composed, kernel: str, covariance: str) -> None:
    text = filter_text(kernel, covariance=covariance).replace("gate: 0.999, ", "")
    growth = "process: {growth: {kind: couple, target: p, source: p, coefficient: [[0, 0], [0, 1.0]]}}\n"
    with (
        np.errstate(all="ignore"),
        pytest.raises(NumericalError, match=r"left the numbers at step (\d+) \(t = \1 s\): p\[[xy]\]") as caught,
    ):
        run(composed(text + growth), [[np.nan, np.nan]] * 1000)
    assert caught.value.exit_code == 6


@pytest.mark.parametrize("kernel", KERNELS)
def test_stiff_dynamics_are_sub_stepped_and_reach_their_steady_state(composed: Composed, kernel: str) -> None:
    text = (
        "estimfw: 1\nblocks: {x: {kind: gauss_markov, unit: m, sigma: 9 m, steady_sigma: 2 m, correlation_time: 1 ms}}\n"
        f"measurements: {{z: {{kind: direct, of: [{{block: x}}], noise: 1 m}}}}\nestimator: {{kernel: {kernel}, kind: kalman}}\n"
    )
    result = run(composed(text), [[np.nan], [1.0]], "z", ("z",))
    np.testing.assert_allclose(result.sigma[:, 0], [2.0, np.sqrt(0.8)], rtol=1e-9)
    assert result.estimate[1, 0] == pytest.approx(0.8, rel=1e-9)


@pytest.mark.parametrize("kernel", KERNELS)
def test_dynamics_too_stiff_for_sub_steps_are_refused(composed: Composed, kernel: str) -> None:
    text = (
        "estimfw: 1\nblocks: {x: {kind: gauss_markov, unit: m, sigma: 9 m, steady_sigma: 2 m, correlation_time: 1e-9 s}}\n"
        f"measurements: {{z: {{kind: direct, of: [{{block: x}}], noise: 1 m}}}}\nestimator: {{kernel: {kernel}, kind: kalman}}\n"
    )
    with pytest.raises(NumericalError, match=r"too stiff for the step[\s\S]*shorten the step") as caught:
        run(composed(text), [[1.0], [1.0]], "z", ("z",))
    assert caught.value.exit_code == 6


def test_a_column_that_the_stream_lacks_is_named_with_those_it_has(composed: Composed) -> None:
    with pytest.raises(DataError, match=r"measurement 'fix' needs the column 'y'[\s\S]*the stream has: x, z"):
        run(composed(filter_text("numpy")), [[0.0, 0.0]], columns=("x", "z"))


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_stream_without_rows_leaves_the_others_to_the_filter(composed: Composed, kernel: str) -> None:
    text = filter_text(kernel).replace(
        "estimator:",
        "  beacon: {kind: direct, of: [{block: p}], noise: 1 m, stream: beacon, columns: [x, y]}\nestimator:",
    )
    problem = composed(
        text.replace("measurements: {fix: {", "measurements:\n  fix: {").replace("noise: 1 m}}\n", "noise: 1 m}\n")
    )
    fixes = Stream("fix", np.arange(1.0, 4.0), np.zeros((3, 2)), ("x", "y"), "sample", 1.0)
    nothing = Stream("beacon", np.zeros(0), np.zeros((0, 2)), ("x", "y"), "sample", 1.0)
    done = run_problem(problem, record=Record({"fix": fixes, "beacon": nothing}, initial={"time": np.array(0.0)}))
    np.testing.assert_array_equal(done.disposition, [[FUSED, -1]] * 3)
    assert [e.text for e in done.events if e.kind == "no rows"] == ["the stream is empty: nothing of it is fused"]
