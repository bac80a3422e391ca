"""The gravimeter's partition is the published one; what it costs to neglect what is between the groups is told with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.analysis.partition import best_cut
from estimfw.config.compose import Problem
from estimfw.errors import ConfigError, UsageError
from estimfw.report.partition_tables import partition_json, warning_texts
from estimfw.run.partition import Partitioned, partition_filter
from tests.run.gravimeter_text import gravimeter

Composed = Callable[[str], Problem]
Example = Callable[..., Problem]

# The specification of the gravimeter's alignment, section 5.
SHORT = {
    "dVx": "velocity_error[x]", "dVy": "velocity_error[y]", "phi_x": "tilt[x]", "phi_y": "tilt[y]", "phi_z": "azimuth",
    "dA_x": "accel_bias[x]", "dA_y": "accel_bias[y]", "eps_x": "drift[x]", "eps_y": "drift[y]", "eps_z": "azimuth_drift",
}  # fmt: skip
PUBLISHED = {
    30: (5.83243, 5.79442, "dVx phi_x phi_y dA_x dA_y / dVy phi_z eps_x eps_y eps_z"),
    0: (3.74471, 3.67399, "dVx phi_x dA_y eps_y eps_z / dVy phi_y phi_z dA_x eps_x"),
}
AXES = "dVx phi_y dA_x eps_y eps_z / dVy phi_x phi_z dA_y eps_x"
# Each with half of its last digit.
RATIOS = {
    30: ((59, 0.5), (23700, 50), (1.15, 0.005), (4.3, 0.05)),
    0: ((38, 0.5), (105000, 500), (1.02, 0.005), (19, 0.5)),
}


def groups_of(text: str) -> list[set[str]]:
    return [{SHORT[name] for name in part.split()} for part in text.split("/")]


@pytest.fixture(scope="module")
def found(composed: Composed) -> Callable[[int], Partitioned]:
    return cache(lambda alpha: partition_filter(composed(gravimeter(alpha)), 2))


def named(found: Partitioned, groups: tuple[tuple[int, ...], ...]) -> list[set[str]]:
    return [{found.states[i] for i in g} for g in groups]


@pytest.mark.parametrize("alpha", [30, 0])
def test_groups_and_objective_are_the_published_ones(found: Callable[[int], Partitioned], alpha: int) -> None:
    best, second, groups = PUBLISHED[alpha]
    made = found(alpha)
    cut = made.by_correlation.cut
    assert named(made, cut.groups) == groups_of(groups)
    assert [cut.objective, cut.runner_up_objective] == pytest.approx([best, second], abs=5e-6)  # to the digits printed
    assert cut.cases == 70
    greedy = best_cut(np.abs(made.correlation), (5, 5), made.seeds, exact=False)
    assert greedy.groups == cut.groups and not greedy.exact
    assert made.time == 1200.0 and made.settled


def test_the_next_best_at_30_deg_exchanges_the_velocities(found: Callable[[int], Partitioned]) -> None:
    made = found(30)
    second = made.by_correlation.cut.runner_up
    assert second is not None
    exchanged = PUBLISHED[30][2].replace("dVx", "?").replace("dVy", "dVx").replace("?", "dVy")
    assert sorted(map(sorted, named(made, second))) == sorted(map(sorted, groups_of(exchanged)))


@pytest.mark.parametrize("alpha", [30, 0])
def test_physical_coupling_finds_the_axes_at_either_angle(found: Callable[[int], Partitioned], alpha: int) -> None:
    assert named(found(alpha), found(alpha).by_coupling.cut.groups) == groups_of(AXES)


@pytest.mark.parametrize("alpha", [30, 0])
def test_true_over_optimal_sigmas_are_the_published_ones(found: Callable[[int], Partitioned], alpha: int) -> None:
    made = found(alpha)
    ratios = [float(p.ratio[p.worst]) for by in (made.by_correlation, made.by_coupling) for p in by.prices]
    for ratio, (printed, half) in zip(ratios, RATIOS[alpha], strict=True):
        assert ratio == pytest.approx(printed, abs=half)


def test_rows_belong_to_the_group_of_the_states_that_they_read(found: Callable[[int], Partitioned]) -> None:
    one, two = found(30).by_correlation.nodes
    assert (one.rows, two.rows) == (("velocity[x]",), ("velocity[y]",))
    assert one.blocks == ("velocity_error[x]", "tilt", "accel_bias") and one.measurements == ("velocity[x]",)
    assert two.blocks == ("velocity_error[y]", "azimuth", "drift", "azimuth_drift")


def test_given_sizes_are_kept(composed: Composed) -> None:
    made = partition_filter(composed(gravimeter(0, 300)), 2, (7, 3), price=False)
    assert sorted(len(g) for g in made.by_correlation.cut.groups) == [3, 7]
    assert made.by_correlation.prices == () and made.unpriced == "--no-price"


def test_a_run_that_is_too_short_has_not_converged(composed: Composed) -> None:
    made = partition_filter(composed(gravimeter(30, 60)), 2, price=False)
    assert not made.settled and made.change > 0.05 and made.since == pytest.approx(54.0, abs=1.5)


PAIR = """\
estimfw: 1
blocks:
  a: {kind: random_walk, unit: m, sigma: 1 m, noise: 1 m/sqrt(s)}
  b: {kind: random_walk, unit: m, sigma: 1 m, noise: 1 m/sqrt(s)}
  c: {kind: random_constant, unit: m, sigma: %s}
process: {link: {kind: couple, target: a, source: c, coefficient: 0.1}}
measurements:
%s
estimator: %s
source: {kind: simulate_model, duration: 40 s, rate: 1 Hz, seed: 1}
"""
BOTH = "  sum: {kind: direct, of: [{block: a}, {block: b}], noise: 1 m}\n  of_c: {kind: direct, of: [{block: c}], noise: 1 m}"
CHAIN = BOTH + "\n  tie: {kind: direct, of: [{block: b}, {block: c}], noise: 1 m}"
KALMAN = "{kind: kalman}"


def test_states_without_variance_are_named_and_tied_to_nothing(composed: Composed) -> None:
    made = partition_filter(composed(PAIR % ("0 m", "  of_a: {kind: direct, of: [{block: a}], noise: 1 m}", KALMAN)), 2)
    assert [made.states[i] for i in made.fixed] == ["c"]
    assert not made.correlation[2].any() and not made.by_coupling.weights[2].any()
    assert all(np.isfinite(p.ratio).all() for p in made.by_correlation.prices)


def test_states_that_a_row_reads_stay_together(composed: Composed) -> None:
    made = partition_filter(composed(PAIR % ("1 m", BOTH, KALMAN)), 2)
    assert made.seeds == ((0, 1), (2,)) and made.by_correlation.cut.groups == ((0, 1), (2,))
    assert [n.rows for n in made.by_correlation.nodes] == [("sum",), ("of_c",)]


def test_rows_that_share_states_are_a_reason_not_to_cut(composed: Composed) -> None:
    with pytest.raises(ConfigError, match="the rows sum, of_c, tie share states, and read all states"):
        partition_filter(composed(PAIR % ("1 m", CHAIN, KALMAN)), 2)
    with pytest.raises(ConfigError, match="2 states") as error:
        partition_filter(composed(PAIR % ("1 m", BOTH, KALMAN)), 3)
    assert error.value.hint == "such as --sizes 2,1" and error.value.location is not None


@pytest.mark.parametrize(
    ("into", "sizes", "what"),
    [
        (1, (), "one group is the filter"),
        (4, (), "cannot be cut into 4"),
        (2, (2, 2), "add up to 3"),
        (2, (3, 0), "add up"),
    ],
)
def test_odd_sizes_are_refused(composed: Composed, into: int, sizes: tuple[int, ...], what: str) -> None:
    with pytest.raises(UsageError) as error:
        partition_filter(composed(PAIR % ("1 m", BOTH, KALMAN)), into, sizes)
    assert what in f"{error.value.message} {error.value.hint}"


def test_no_measurement_no_bank_no_unscented_filter_no_determination(composed: Composed, example: Example) -> None:
    with pytest.raises(ConfigError, match="no measurement"):
        partition_filter(composed(PAIR.replace("measurements:\n%s\n", "") % ("1 m", KALMAN)), 2)
    with pytest.raises(ConfigError, match="unscented"):
        partition_filter(composed(PAIR % ("1 m", BOTH, "{kind: unscented}")), 2)
    with pytest.raises(ConfigError, match="bank"):
        partition_filter(example("static_bank"), 2)
    with pytest.raises(ConfigError, match="determination"):
        partition_filter(example("odometer_adba"), 2)


def test_prices_count_from_the_last_restart(composed: Composed) -> None:
    whole = PAIR % ("1 m", BOTH, KALMAN)
    late = partition_filter(composed(whole.replace("{kind: kalman}", "{kind: kalman, restarts: [30 s]}")), 2)
    fresh = partition_filter(composed(whole.replace("duration: 40 s", "duration: 10 s")), 2)
    for a, b in zip(late.by_correlation.prices, fresh.by_correlation.prices, strict=True):
        np.testing.assert_allclose(a.ratio, b.ratio, rtol=1e-9)


def test_a_nominal_that_varies_is_averaged(example: Example) -> None:
    made = partition_filter(example("static_12", "source.duration=20 s"), 3)
    weights: NDArray[np.float64] = made.by_coupling.weights
    assert np.array_equal(weights, weights.T) and weights.max() > 0.0
    assert [len(g) for g in made.by_coupling.cut.groups] == [4, 4, 4]


def test_a_run_of_one_step_is_too_short_to_tell(composed: Composed) -> None:
    made = partition_filter(composed(gravimeter(30, 1)), 2, price=False)
    assert np.isnan(made.change) and not made.settled
    assert "too short" in warning_texts(made)[0]
    assert partition_json(made)["change"]["largest"] is None


def test_stages_are_refused(composed: Composed) -> None:
    stages = "{kind: kalman, stages: [{name: first, until: 20 s, estimate: [a, b]}, {name: second}]}"
    with pytest.raises(ConfigError, match="stage"):
        partition_filter(composed(PAIR % ("1 m", BOTH, stages)), 2)
