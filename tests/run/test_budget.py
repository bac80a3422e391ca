"""An error budget adds up, agrees with what many runs show, and knows a truth that the filter does not."""

from __future__ import annotations

from collections.abc import Callable
from io import StringIO

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.console import Console
from scipy.stats import chi2

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.montecarlo.campaign import run_campaign
from estimfw.montecarlo.dataset import campaign_dataset
from estimfw.montecarlo.draw import draw_runs
from estimfw.report.budget_text import print_budget
from estimfw.run.budget import Budget, error_budget
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]
Composed = Callable[[str], Problem]
Example = Callable[..., Problem]

TRACKER = """\
estimfw: 1
name: %s
blocks:
  position: {kind: random_constant, unit: m, sigma: 50 m}
  velocity: {kind: random_walk, unit: m/s, sigma: 5 m/s, noise: 0.3 m/s/sqrt(s)}
  drift: %s
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
measurements:
  fix: {kind: direct, of: [{block: position}, {block: drift}], noise: 3 m}
  survey: {kind: direct, of: [{block: position}], noise: 20 m}
estimator: {kind: kalman}
%s
source: {kind: simulate_model, duration: 60 s, rate: 1 Hz, seed: 7}
"""
CONSTANT = "{kind: random_constant, unit: m, sigma: 8 m}"
WANDERING = "{kind: gauss_markov, unit: m, sigma: 8 m, steady_sigma: 8 m, correlation_time: 20 s}"
DROPPED = "policies: [{kind: drop_states, states: [drift]}]"
REDUCED = TRACKER % ("reduced", WANDERING, DROPPED)
ASSUMED = TRACKER % ("a drift that is assumed constant", CONSTANT, "")
REAL = TRACKER % ("a drift that wanders", WANDERING, "")


def column(budget: Budget, label: str) -> int:
    return budget.quantities.index(label)


def source(budget: Budget, name: str) -> int:
    return [s.name for s in budget.sources].index(name)


@pytest.mark.parametrize("case", ["reduced", "alignment", "closed loop", "heater"])
def test_squares_add_up_to_the_total(composed: Composed, example: Example, case: str) -> None:
    short = ("source.duration=60 s", "estimator.restarts=[20 s]")
    made: dict[str, Callable[[], Problem]] = {
        "reduced": lambda: composed(REDUCED),
        "alignment": lambda: example("static_7", *short),
        "closed loop": lambda: example("static_7", *short, "estimator.loop=closed"),
        "heater": lambda: example("thermal", "policies=[{kind: drop_term, terms: [heating]}]"),
    }
    budget = error_budget(made[case]())
    together = np.sqrt((budget.contributions**2).sum(axis=1))
    assert np.all(np.abs(together - budget.total) <= 1e-9 * budget.total)
    assert np.all(budget.total > 0.0)


def test_the_total_is_the_honest_sigma_of_the_run(composed: Composed) -> None:
    problem = composed(REDUCED)
    honest = run_problem(problem).honest
    assert honest is not None
    np.testing.assert_allclose(error_budget(problem).total[-1], honest.sigma[-1], rtol=1e-12)


def test_a_filter_that_is_not_reduced_owns_all_of_its_error(composed: Composed) -> None:
    budget = error_budget(composed(REAL))
    np.testing.assert_allclose(budget.total, budget.own, rtol=1e-8)


def within(rms: FloatArray, sigma: FloatArray, runs: int) -> bool:
    """Is the rms of so many runs what sigma says, to one in ten thousand?"""
    low, high = (float(chi2.ppf(level, runs)) for level in (5e-5, 1.0 - 5e-5))
    return bool(np.all((runs * (rms / sigma) ** 2 > low) & (runs * (rms / sigma) ** 2 < high)))


def test_the_total_is_what_four_hundred_runs_show(composed: Composed) -> None:
    problem = composed(REDUCED)
    budget, dataset = error_budget(problem), campaign_dataset(run_campaign(problem, 5, 400))
    error = dataset["end_error"].to_numpy()[:, -2:]
    assert within(np.sqrt((error**2).mean(axis=0)), budget.total[-1], 400)
    assert not within(np.sqrt((error**2).mean(axis=0)), budget.own[-1], 400)


def last_errors(problem: Problem, other: Problem, seed: int) -> FloatArray:
    """Errors (400, n) at the end of a filter on 400 records of another model: a textbook's recursion on all of them at once."""
    draws, plan = draw_runs(other, seed, range(400)), problem.plan
    row = np.zeros(0)
    Phi, Q, _ = plan.discretised(row, np.zeros(0), np.array(1.0), 0)
    H = np.concatenate([m.H.evaluate(row) for m in plan.measurements])
    R = np.diag([m.R[0][0] for m in plan.measurements])
    z = np.stack([draws.record.streams[m.name].values[..., 0] for m in plan.measurements], axis=-1)
    P, x = plan.prior.evaluate({})[1], np.zeros((400, len(plan.states)))
    for k in range(60):
        x, P = x @ Phi.T, Phi @ P @ Phi.T + Q
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        x, P = x + (z[:, k] - x @ H.T) @ K.T, (np.eye(len(P)) - K @ H) @ P
    assert draws.truth is not None
    return x - np.stack([draws.truth[f"state:{s}"][:, -1] for s in plan.states], axis=-1)


@pytest.mark.parametrize(
    ("name", "quiet"),
    [
        ("drift.noise", "no noise of the drift"),
        ("fix", "a perfect radar"),
    ],
)
def test_a_contribution_is_what_four_hundred_runs_lack_without_its_source(
    composed: Composed, name: str, quiet: str
) -> None:
    """The same filter on records that lack one source: what is missing of the mean square is that source's part."""
    problem = composed(REDUCED)
    budget = error_budget(problem)
    silent = {
        "drift.noise": REDUCED.replace("steady_sigma: 8 m", "steady_sigma: 1e-6 m"),
        "fix": REDUCED.replace("noise: 3 m", "noise: 1e-6 m"),
    }[name]
    other = composed(silent)
    errors = last_errors(problem, other, 11)
    rest = np.sqrt(budget.total[-1] ** 2 - budget.contributions[-1, source(budget, name)] ** 2)
    assert within(np.sqrt((errors**2).mean(axis=0)), rest, 400), quiet


def test_a_wandering_truth_under_a_filter_that_assumes_a_constant_shows_its_true_sigma(composed: Composed) -> None:
    assumed, real = composed(ASSUMED), composed(REAL)
    budget = error_budget(assumed, real)
    assert budget.truth_name == "a drift that wanders"
    rms = np.sqrt((last_errors(assumed, real, 3) ** 2).mean(axis=0))
    assert within(rms, budget.total[-1], 400)
    position = column(budget, "position")
    assert budget.total[-1, position] > 1.5 * budget.own[-1, position]
    assert budget.sources[budget.largest(position)[0]].name == "drift.noise"


def test_removed_states_are_named_so(composed: Composed) -> None:
    kinds = {s.name: s.kind for s in error_budget(composed(REDUCED)).sources}
    assert kinds["drift"] == "removed state"
    assert kinds["position"] == "initial error"
    assert kinds["drift.noise"] == "process noise"
    assert kinds["survey"] == "measurement noise"


def test_a_truth_in_other_units_is_refused(composed: Composed) -> None:
    warm = REAL.replace(WANDERING, CONSTANT.replace("8 m", "8 K").replace("unit: m", "unit: K"))
    with pytest.raises(ConfigError, match=r"drift is in K .* in m"):
        error_budget(composed(ASSUMED), composed(warm.replace(", {block: drift}", "")))


def test_the_noise_of_the_measurements_is_that_of_the_truth(composed: Composed) -> None:
    """A filter that believes the survey too much."""
    trusting = composed(REAL.replace("noise: 20 m", "noise: 1 m"))
    budget = error_budget(trusting, composed(REAL))
    rms = np.sqrt((last_errors(trusting, composed(REAL), 17) ** 2).mean(axis=0))
    assert within(rms, budget.total[-1], 400)
    assert not within(rms, budget.own[-1], 400)


def test_a_known_input_that_the_truth_lacks_is_a_source(example: Example) -> None:
    cold = example("thermal", "process.heating.coefficient=0.0", "source.duration=600 s")
    budget = error_budget(example("thermal", "source.duration=600 s"), cold)
    together = np.sqrt((budget.contributions**2).sum(axis=1))
    assert np.all(np.abs(together - budget.total) <= 1e-9 * budget.total)
    core = column(budget, "core")
    assert budget.sources[budget.largest(core)[0]].kind == "known values"


@pytest.mark.parametrize("sigma", ["10 m", "1e4 m", "1e6 m"])
def test_a_large_prior_loses_nothing_in_the_sum(example: Example, sigma: str) -> None:
    short = ("source.duration=20 s", "estimator.gate=null", f"blocks.position.sigma={sigma}")
    budget = error_budget(example("tracker_bias", *short, f"blocks.radar_bias.sigma={sigma}"))
    together = np.sqrt((budget.contributions**2).sum(axis=1))
    assert np.all(np.abs(together - budget.total) <= 1e-9 * budget.total)
    assert np.all(np.abs(budget.total / budget.own - 1.0)[-1] < 1e-5)


def test_what_is_removed_does_not_hang_on_the_sizes_of_others(example: Example) -> None:
    kinds = {
        size: {s.name: s.kind for s in error_budget(example("static_7", "source.duration=5 s", size)).sources}
        for size in ("blocks.velocity_error.sigma=0.1 m/s", "blocks.velocity_error.sigma=1e9 m/s")
    }
    first, second = kinds.values()
    assert first == second and first["gyro_bias[R]"] == "removed state" and first["gyro_bias[U]"] == "initial error"


def test_a_source_of_rounding_is_not_named(example: Example) -> None:
    budget = error_budget(example("tracker", "source.duration=60 s"))
    for i in range(len(budget.quantities)):
        assert min(budget.shares[-1, s, i] for s in budget.largest(i)) > 1e-6


def test_shares_are_found_once(composed: Composed) -> None:
    """Tables ask for them by source and quantity: found anew each time, a hundred states took a minute."""
    budget = error_budget(composed(REDUCED))
    assert budget.shares is budget.shares
    np.testing.assert_allclose(budget.shares.sum(axis=1), 1.0, rtol=1e-9)


def test_a_budget_of_very_many_quantities_is_told_without_a_table_that_no_terminal_holds(example: Example) -> None:
    told = StringIO()
    print_budget(error_budget(example("chain_100", "source.duration=0.2 s")), Console(file=told, width=140))
    assert "160 sources to 100 quantities: on a page" in told.getvalue()
    assert "position_1[m1]: " in told.getvalue() and "the filter's own sigma" not in told.getvalue()


def test_a_budget_of_few_quantities_is_told_with_all_sources(composed: Composed) -> None:
    told = StringIO()
    print_budget(error_budget(composed(REDUCED)), Console(file=told, width=140))
    assert "the filter's own sigma" in told.getvalue()
