"""The exact quotient of models that are not alignment: the whole filter's innovations on the whole model's record."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.run.dataset import result_dataset
from estimfw.run.load import load_record
from estimfw.run.run import run_problem

Example = Callable[..., Problem]
WANDERING = "blocks.beacon_bias={kind: random_walk, unit: m, axes: [x, y], sigma: 2 m, noise: 0.05 m/sqrt(s)}"
WARM = (
    "blocks.ambient={kind: random_walk, unit: K, sigma: 5 K, noise: 0.002 K/sqrt(s)}",
    "blocks.sensor_bias={kind: random_constant, unit: K, sigma: 1 K}",
    "process.ambient_gain={kind: couple, target: case, source: ambient, coefficient: 0.00055555555555555556}",
    "measurements.case_sensor.of=[{block: case}, {block: sensor_bias}]",
)
CASES: dict[str, tuple[str, tuple[str, ...], str, set[str]]] = {
    "constant bias": ("tracker_bias", (), "[position]", {"beacon_bias"}),
    "a bias that noise drives": ("tracker_bias", (WANDERING,), "[position, radar_bias]", {"beacon_bias"}),
    "positions that velocities drive": ("tracker_bias", (WANDERING,), "[radar_bias, beacon_bias]", {"position"}),
    "thermal, its sensor's bias": ("thermal", WARM, "[case, core, ambient]", {"sensor_bias"}),
    "thermal, a driven node": ("thermal", WARM, "[case, sensor_bias, ambient]", {"core"}),
    "thermal, the node that is heated from outside": ("thermal", WARM, "[core, sensor_bias, ambient]", {"case"}),
}


def pair(example: Example, case: str) -> tuple[Problem, Problem]:
    name, overrides, protect, _ = CASES[case]
    policy = f"policies=[{{kind: prune_unobservable, mode: quotient, protect: {protect}}}]"
    return example(name, *overrides), example(name, *overrides, policy)


@pytest.mark.parametrize("case", CASES)
def test_on_the_whole_models_record_innovations_and_estimates_are_those_of_the_whole_filter(
    example: Example, case: str
) -> None:
    whole, reduced = pair(example, case)
    quotient = reduced.model.quotient
    assert quotient is not None
    gone = set(whole.plan.states) - set(reduced.plan.states)
    assert {label.partition("[")[0] for label in gone} == CASES[case][3]
    record = load_record(whole)
    long, short = (run_problem(p, record=record) for p in (whole, reduced))
    assert np.nanmax(np.abs(short.innovation - long.innovation) / long.innovation_sigma) < 1e-9
    T, last = quotient.T, short.covariance[-1]
    sigma = np.sqrt(np.diag(last))
    assert np.max(np.abs(short.estimate - long.estimate @ T.T) / sigma) < 1e-9
    assert np.max(np.abs(last - T @ long.covariance[-1] @ T.T) / np.outer(sigma, sigma)) < 1e-9
    assert long.truth is not None and short.truth is not None
    np.testing.assert_allclose(short.truth, long.truth @ T.T, rtol=1e-12, atol=1e-12)


def test_what_drove_a_state_that_went_is_there_under_its_label(example: Example) -> None:
    _, wandering = pair(example, "a bias that noise drives")
    labels = [t.label for t in wandering.model.terms]
    assert "beacon_bias.driving_noise" not in labels and "beacon_bias.driving_noise.into_radar_bias" in labels
    _, cool = pair(example, "thermal, a driven node")
    assert any(t.source == "heater" and t.label.startswith("heating.into_") for t in cool.model.terms)


def test_deleting_instead_is_not_the_same(example: Example) -> None:
    """Else the comparison above would show nothing."""
    whole, _ = pair(example, "a bias that noise drives")
    deleted = example(
        "tracker_bias", WANDERING, "policies=[{kind: prune_unobservable, protect: [position, radar_bias]}]"
    )
    record = load_record(whole)
    long, short = (run_problem(p, record=record) for p in (whole, deleted))
    assert np.nanmax(np.abs(short.innovation - long.innovation) / long.innovation_sigma) > 1e-3


def test_a_record_simulated_of_the_quotient_itself_knows_its_states(example: Example) -> None:
    _, reduced = pair(example, "constant bias")
    done = result_dataset(run_problem(reduced))
    assert np.all(np.isfinite(done["error"]))
    assert str(done["state_meaning"].to_numpy()[0]) == "position[x] + beacon_bias[x]"


def test_where_too_much_is_protected_it_says_what_must_go(example: Example) -> None:
    with pytest.raises(ConfigError, match="2 states must go"):
        example(
            "tracker_bias",
            "policies=[{kind: prune_unobservable, mode: quotient, protect: [position, radar_bias, beacon_bias]}]",
        )


def test_nothing_to_prune_leaves_the_model_and_later_policies_alone(example: Example) -> None:
    left = example(
        "tracker", "policies=[{kind: prune_unobservable, mode: quotient}, {kind: prune_unobservable, mode: delete}]"
    )
    assert left.model == left.full and left.model.state_meanings == left.model.states
