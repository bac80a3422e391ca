"""The unscented filter: the linear one where all is linear, as good where little bends, better where much does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import FloatArray
from estimfw.errors import ConfigError, PluginError
from estimfw.estimators.scan import ChunkResult
from estimfw.estimators.sigma_points import Spread
from estimfw.model.coefficient import identity, vector
from estimfw.model.parts import Measurement, MeasurementTerm
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import make_plan
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare
from estimfw.run.run import run_problem

Example = Callable[..., Problem]
EXTENDED = "estimator={kind: kalman, loop: closed, kernel: numpy}"


def outcome(problem: Problem) -> ChunkResult:
    """The whole run in one chunk."""
    prepared = prepare(problem, load_record(problem))
    return prepared.scan.run(prepared.state, make_chunk(prepared, 0, len(prepared.steps)))[1]


def assert_equal(linear: ChunkResult, other: ChunkResult) -> None:
    """To 1e-10 of a sigma, dispositions and likelihoods included."""
    sigma = np.sqrt(np.einsum("kii->ki", linear.covariance))
    assert np.max(np.abs(linear.estimate - other.estimate) / sigma) < 1e-10
    assert np.max(np.abs(linear.covariance - other.covariance) / (sigma[:, :, None] * sigma[:, None, :])) < 1e-10
    np.testing.assert_allclose(other.innovation, linear.innovation, rtol=0, atol=1e-10 * np.nanmax(linear.sigma))
    np.testing.assert_allclose(other.sigma, linear.sigma, rtol=1e-10)
    np.testing.assert_allclose(other.nis, linear.nis, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.log_det, linear.log_det, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(other.disposition, linear.disposition)
    np.testing.assert_array_equal(other.used, linear.used)


@pytest.mark.parametrize("spread", ["", ", alpha: 0.5", ", kappa: 2, beta: 0"])
@pytest.mark.parametrize("name", ["tracker", "thermal"])
def test_a_linear_model_gives_the_linear_filter_whatever_the_spread(example: Example, name: str, spread: str) -> None:
    gate = "gate: 0.9, restarts: [20.5 s]"
    linear = outcome(example(name, f"estimator={{kind: kalman, kernel: numpy, {gate}}}"))
    assert_equal(linear, outcome(example(name, f"estimator={{kind: unscented, {gate}{spread}}}")))
    assert set(np.unique(linear.disposition)) >= {0, 1}, "nothing was gated"


def with_fix(problem: Problem) -> Problem:
    """The boat with its computed position compared with zero every 0.5 s: linear through provider and correction."""
    three = tuple(tuple(row) for row in (np.eye(3) * 400.0).tolist())
    axes = ("E", "N", "U")
    fix = Measurement(
        "fix", axes, axes, "m", (MeasurementTerm("position_error", identity(3)),), three, "per_measurement",
        frame="n", innovation=vector("position_n"), sign=-1.0, every=0.5,
    )  # fmt: skip
    model = problem.model.with_parts(measurements=(fix,), derived=())
    layout = NominalLayout(problem.plan.layout.variables)
    plan = make_plan(model, layout, problem.provider.slots, problem.plan.discretisation, {"fix": 0.9})
    return replace(problem, model=model, plan=plan)


@pytest.mark.parametrize("loop", ["open", "closed"])
def test_a_linear_provider_gives_the_linear_filter_in_either_loop(boat: Example, loop: str) -> None:
    linear, unscented = (
        outcome(with_fix(boat("source.duration=15 s", f"estimator={{kind: {kind}, loop: {loop}}}")))
        for kind in ("kalman", "unscented")
    )
    assert_equal(linear, unscented)
    assert np.any(np.abs(linear.estimate) > 0.5)


def test_the_default_points_give_mean_and_variance_of_a_square_of_a_normal_variable() -> None:
    # E[(m + s u)^2] = m^2 + s^2 and Var = 4 m^2 s^2 + 2 s^4.
    spread, m, s = Spread(), 3.0, 2.0
    points = spread.points(np.array([m]), np.array([[s]]))[:, 0]
    in_mean, in_covariance = spread.weights(1)
    mean = in_mean @ points**2
    assert mean == pytest.approx(m**2 + s**2, rel=1e-14)
    assert in_covariance @ (points**2 - mean) ** 2 == pytest.approx(4 * m**2 * s**2 + 2 * s**4, rel=1e-14)


@pytest.mark.parametrize("spread", [Spread(), Spread(1e-2, 2.0, 0.0), Spread(1.0, 0.0, 2.0)])
def test_points_have_the_mean_and_covariance_that_they_are_made_for(spread: Spread) -> None:
    rng = np.random.default_rng(3)
    mean, root = rng.normal(size=4), rng.normal(size=(4, 4))
    points, (in_mean, in_covariance) = spread.points(mean, root), spread.weights(4)
    np.testing.assert_allclose(in_mean @ points, mean, rtol=0, atol=1e-9)
    aside = points - mean
    np.testing.assert_allclose((aside * in_covariance[:, None]).T @ aside, root @ root.T, rtol=0, atol=1e-9)


STATIC = ("policies=[]", "source.duration=200 s")


def attitude_error(result: ChunkResult) -> FloatArray:
    """E, N, U in rad of the nominal corrected by the last estimate; the truth is the identity."""
    from scipy.spatial.transform import Rotation

    C = Rotation.from_rotvec(result.estimate[-1, 3:6]) * Rotation.from_matrix(result.rows[-1, :9].reshape(3, 3))
    return np.asarray(C.as_rotvec())


def test_static_alignment_of_a_degree_is_that_of_the_extended_filter(example: Example) -> None:
    extended, unscented = (
        outcome(example("static_12", *STATIC, estimator)) for estimator in (EXTENDED, "estimator={kind: unscented}")
    )
    sigma = np.sqrt(np.einsum("kii->ki", extended.covariance))
    assert np.max(np.abs(attitude_error(extended) - attitude_error(unscented)) / sigma[-1, 3:6]) < 0.3
    np.testing.assert_allclose(np.sqrt(np.diag(unscented.covariance[-1])), sigma[-1], rtol=0.02)


def test_static_alignment_from_tens_of_degrees_is_better_than_by_the_extended_filter(example: Example) -> None:
    far = (
        "source.misalignment=[20 deg, -20 deg, 30 deg]", "blocks.attitude_error.sigma=30 deg",
    )  # fmt: skip
    extended, unscented = (
        outcome(example("static_12", *STATIC, *far, estimator))
        for estimator in (EXTENDED, "estimator={kind: unscented}")
    )
    for result, low, high in ((extended, 3.0, np.inf), (unscented, 0.0, 2.0)):
        off = attitude_error(result)[2] / np.sqrt(result.covariance[-1, 5, 5])
        assert low < abs(off) < high, "heading error in its own sigmas"
    assert abs(attitude_error(unscented)[2]) < 0.2 * abs(attitude_error(extended)[2])


def near(boat: Example, estimator: str, seed: int, start: FloatArray) -> Problem:
    """Beacons within 100 m, a start known to 40 m: ranges bend over the width of what is not known."""
    beacons = {"pier": "[60 m, 80 m, 0 m]", "rock": "[90 m, -50 m, 0 m]", "tower": "[-30 m, 20 m, 0 m]"}
    places = [f"{path}={at}" for n, at in beacons.items() for path in (f"measurements.{n}.at", f"source.beacons.{n}")]
    return boat(
        f"estimator={estimator}", f"source.seed={seed}", "source.duration=12 s", "source.every=2 s",
        "blocks.position_error.sigma=[40 m, 40 m, 0.5 m]", f"source.start=[{start[0]} m, {start[1]} m, 0 m]", *places,
    )  # fmt: skip


def test_close_to_beacons_it_is_better_and_more_honest_than_the_extended_filter(boat: Example) -> None:
    rng = np.random.default_rng(0)
    errors: dict[str, list[tuple[float, float]]] = {"kalman, loop: closed": [], "unscented": []}
    for seed in range(20):
        start = 40.0 * rng.normal(size=2)
        for kind, own in errors.items():
            done = run_problem(near(boat, f"{{kind: {kind}}}", seed, start))
            assert done.output_error is not None
            e, P = done.output_error[-1, :2], done.covariance[-1, :2, :2]
            own.append((float(e @ e), float(e @ np.linalg.solve(P, e))))
    extended, unscented = (np.array(own) for own in errors.values())
    assert np.sqrt(np.mean(unscented[:, 0])) < 0.8 * np.sqrt(np.mean(extended[:, 0]))
    # NEES of two components: 20 runs of a consistent filter have a mean in 1.2 to 3 with 95 %.
    assert np.mean(extended[:, 1]) > 5.0
    assert 1.2 < np.mean(unscented[:, 1]) < 3.0


def test_a_provider_without_difference_is_refused_by_name(boat: Example, monkeypatch: pytest.MonkeyPatch) -> None:
    import range_beacon.dead_reckoning as own  # type: ignore[import-not-found]

    problem = boat("source.duration=5 s", "estimator={kind: unscented}")
    monkeypatch.delattr(own.BoundDeadReckoning, "difference")
    with pytest.raises(PluginError, match="no `difference"):
        run_problem(problem)


def test_a_spread_that_is_none_is_refused(example: Example) -> None:
    with pytest.raises(ConfigError, match="kappa -2 is negative"):
        example("tracker", "estimator={kind: unscented, kappa: -2}")
    with pytest.raises(ConfigError, match="alpha"):
        example("tracker", "estimator={kind: unscented, alpha: 0}")


@pytest.mark.parametrize(
    ("member", "told"),
    [
        ("{kind: unscented, alph: 1}", r"filter\.alph: unknown key 'alph'\n  did you mean 'alpha'"),
        ("{kind: unscentd}", "settings of the kind kalman or unscented are due"),
        ("{loop: closd}", "filter.loop: 'closd' is not valid here"),
    ],
)
def test_a_fault_of_a_member_is_told_of_its_own_kind(example: Example, member: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        example("tracker", f"estimator={{kind: bank, filter: {member}}}")


def test_missing_components_and_rows_are_masked_as_by_the_linear_filter(example: Example) -> None:
    results = []
    for kind in ("kalman, kernel: numpy", "unscented"):
        problem = example("tracker", "source.duration=30 s", f"estimator={{kind: {kind}}}")
        record = load_record(problem)
        for stream in record.streams.values():
            stream.values[3::5, 0] = np.nan
            stream.values[4::7] = np.nan
        prepared = prepare(problem, record)
        results.append(prepared.scan.run(prepared.state, make_chunk(prepared, 0, len(prepared.steps)))[1])
    assert_equal(*results)
    assert {-1, 0, 3} <= set(np.unique(results[1].disposition)), "fused and missing"
    assert np.any((results[1].used == 1) & (results[1].disposition == 0)), "a half of a fix was fused"


def test_a_bank_takes_unscented_members(boat: Example) -> None:
    starts = "starts: {quantity: position, axis: N, count: 3, spacing: 100 m}"
    done = run_problem(
        boat(
            "source.duration=15 s", "source.start=[20 m, -110 m, 0 m]",
            f"estimator={{kind: bank, {starts}, filter: {{kind: unscented}}}}",
        )
    )  # fmt: skip
    assert done.output_error is not None
    assert np.all(np.abs(done.output_error[-1]) < 4.0 * done.output_sigma[-1])
