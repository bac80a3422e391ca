"""The policies turn the 12-state model into eq. (16), at any attitude and in any order that is possible."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.policies.prune_unobservable import model_observability
from estimfw.policies.sequence import apply_policies

FloatArray = NDArray[np.float64]
Compose = Callable[..., Problem]

LEVEL: tuple[str, ...] = ("initial_attitude.yaw=0 deg", "initial_attitude.pitch=0 deg", "initial_attitude.roll=0 deg")
TILTED = ("initial_attitude.yaw=130 deg", "initial_attitude.pitch=20 deg", "initial_attitude.roll=-35 deg")
ATTITUDES = pytest.mark.parametrize("attitude", [LEVEL, TILTED], ids=["level", "tilted"])

FIX, CORIOLIS = "sins_static.constant_specific_force", "sins_static.remove_coriolis"
IN_N, FLAT = "sins_static.bias_in_navigation_frame", "sins_static.remove_vertical_channel"
PRUNE = "sins_static.prune_unobservable"

SEVEN = (
    "velocity_error[E]", "velocity_error[N]", "attitude_error[E]", "attitude_error[N]", "attitude_error[U]",
    "gyro_bias[N]", "gyro_bias[U]",
)  # fmt: skip


def policies(*kinds: str) -> str:
    return f"policies=[{', '.join(kinds)}]"


def numbers(problem: Problem) -> tuple[float, float, float]:
    """g, w_N, w_U as the provider has them at this site."""
    w = problem.reference["earth_rate_n"]
    assert w[0] == 0.0
    return float(problem.reference["gravity"]), float(w[1]), float(w[2])


def cross(v: FloatArray) -> FloatArray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def F_of(problem: Problem) -> FloatArray:
    return problem.model.F.coefficient.evaluate(problem.reference)


def diffusion_of(problem: Problem) -> FloatArray:
    return problem.model.diffusion.evaluate(problem.reference)


def eq16(problem: Problem) -> FloatArray:
    """Typed in from the paper; nobody else types it in."""
    g, wN, wU = numbers(problem)
    F = np.zeros((7, 7))
    F[0, 3], F[1, 2] = -g, g
    F[2, 3], F[2, 4] = wU, -wN
    F[3, 2], F[3, 5] = -wU, -1.0
    F[4, 2], F[4, 6] = wN, -1.0
    return F


ARW = 0.001 * np.pi / 180.0 / 60.0
VRW = 10.0 * 9.80665e-6


@ATTITUDES
def test_five_policies_give_eq_16_to_the_last_bit(composed: Compose, attitude: tuple[str, ...]) -> None:
    problem = composed("static_7", *attitude)
    assert problem.model.states == SEVEN
    assert np.array_equal(F_of(problem), eq16(problem))
    assert np.array_equal(problem.model.H("zero_velocity").coefficient.evaluate({}), np.eye(2, 7))
    density = np.array([VRW**2] * 2 + [ARW**2] * 3 + [0.0] * 2)
    D = diffusion_of(problem)
    assert np.array_equal(D, np.diag(np.diag(D)))
    assert np.allclose(np.diag(D), density, rtol=4e-16, atol=0.0)
    assert np.array_equal(problem.model.R("zero_velocity"), 0.1**2 * np.eye(2))


@ATTITUDES
def test_nothing_that_varies_is_left(composed: Compose, attitude: tuple[str, ...]) -> None:
    problem = composed("static_7", *attitude)
    assert problem.model.needs == {"gravity", "earth_rate_n"}
    assert problem.plan.time_invariant


@ATTITUDES
def test_the_12_state_model_is_that_of_the_paper(composed: Compose, attitude: tuple[str, ...]) -> None:
    problem = composed("static_12", *attitude)
    g, wN, wU = numbers(problem)
    R, W = problem.reference["C_bn"], cross(np.array([0.0, wN, wU]))
    F = np.zeros((12, 12))
    F[0:3, 0:3], F[0:3, 3:6], F[0:3, 6:9] = -2.0 * W, cross(np.array([0.0, 0.0, g])), R
    F[3:6, 3:6], F[3:6, 9:12] = -W, -R
    assert np.array_equal(F_of(problem), F)
    assert np.array_equal(problem.model.H("zero_velocity").coefficient.evaluate({}), np.eye(3, 12))
    assert np.allclose(np.diag(diffusion_of(problem)), [VRW**2] * 3 + [ARW**2] * 3 + [0.0] * 6, rtol=4e-16, atol=0.0)


@ATTITUDES
def test_10_states_are_rows_and_columns_of_12(composed: Compose, attitude: tuple[str, ...]) -> None:
    ten, twelve = composed("static_10", *attitude), composed("static_12", *attitude)
    kept = [0, 1, 3, 4, 5, 6, 7, 9, 10, 11]
    both = np.ix_(kept, kept)
    assert ten.model.states == tuple(twelve.model.states[i] for i in kept)
    assert np.array_equal(F_of(ten), F_of(twelve)[both])
    assert np.array_equal(diffusion_of(ten), diffusion_of(twelve)[both])
    assert np.array_equal(
        ten.model.prior.evaluate(ten.reference)[1], twelve.model.prior.evaluate(ten.reference)[1][both]
    )
    assert np.array_equal(ten.model.H("zero_velocity").coefficient.evaluate({}), np.eye(2, 10))


# -- order ---------------------------------------------------------------------------------------------------------------


def possible(order: tuple[str, ...]) -> bool:
    return order.index(IN_N) < min(order.index(FLAT), order.index(PRUNE))


@ATTITUDES
def test_every_order_with_frame_changes_before_axis_removal_gives_the_same_model(
    composed: Compose, attitude: tuple[str, ...]
) -> None:
    problem = composed("static_7", *attitude)
    by_label = {p.label: p for p in problem.policies}
    orders = [o for o in permutations(by_label) if possible(o)]
    assert len(orders) == 40
    for order in orders:
        made, _ = apply_policies(problem.full, [by_label[label] for label in order], problem.reference)
        assert made == problem.model, order
        assert np.array_equal(made.F.coefficient.evaluate(problem.reference), eq16(problem)), order


@ATTITUDES
def test_every_other_order_is_refused_with_the_right_one_named(composed: Compose, attitude: tuple[str, ...]) -> None:
    problem = composed("static_7", *attitude)
    by_label = {p.label: p for p in problem.policies}
    orders = [o for o in permutations(by_label) if not possible(o)]
    assert len(orders) == 80
    for order in orders:
        first = min((FLAT, PRUNE), key=order.index)
        with pytest.raises(ConfigError, match=f"policy '{IN_N}': block '.*' has already lost") as caught:
            apply_policies(problem.full, [by_label[label] for label in order], problem.reference)
        assert caught.value.hint == f"put '{IN_N}' before '{first}'", order


def test_in_a_config_the_place_is_named_too(composed: Compose) -> None:
    with pytest.raises(ConfigError) as caught:
        composed("static_12", policies(FIX, FLAT, IN_N))
    assert caught.value.location is not None
    assert caught.value.hint == f"put '{IN_N}' before '{FLAT}'"


# -- each policy alone -----------------------------------------------------------------------------------------------------


def alone(composed: Compose, kind: str) -> tuple[Problem, Model, Any]:
    """On the full model with measured f_n: before, after, and the change."""
    problem = composed("static_12", policies(kind), *TILTED)
    return problem, problem.full, problem.changes[0]


def test_constant_specific_force_alone(composed: Compose) -> None:
    problem, full, change = alone(composed, FIX)
    assert full.F.coefficient.needs - problem.model.F.coefficient.needs == {"f_n"}
    assert change.kind == "approximate"
    assert change.removed_terms == change.removed_states == ()
    moving = {**problem.reference, "f_n": np.array([0.3, -0.2, 9.9])}
    g = float(problem.reference["gravity"])
    assert np.array_equal(problem.model.F.coefficient.evaluate(moving)[0:3, 3:6], cross(np.array([0.0, 0.0, g])))
    assert np.array_equal(full.F.coefficient.evaluate(moving)[0:3, 3:6], cross(np.array([0.3, -0.2, 9.9])))


def test_remove_coriolis_alone(composed: Compose) -> None:
    problem, full, change = alone(composed, CORIOLIS)
    assert change.kind == "mirrored"
    assert change.removed_terms == ("coriolis",)
    difference = full.F.coefficient.evaluate(problem.reference) - F_of(problem)
    assert np.array_equal(difference[0:3, 0:3], -2.0 * cross(problem.reference["earth_rate_n"]))
    difference[0:3, 0:3] = 0.0
    assert not difference.any()
    coriolis = next(c for c in problem.checks if c.operation == "coriolis")
    assert not coriolis.computed  # the mechanization has heard of it
    assert coriolis.equivalent


def test_bias_in_navigation_frame_alone(composed: Compose) -> None:
    problem, full, change = alone(composed, IN_N)
    assert change.kind == "exact"
    assert change.removed_states == ()
    R = problem.reference["C_bn"]
    T = np.eye(12)
    T[6:9, 6:9] = T[9:12, 9:12] = R
    assert np.array_equal(change.map.evaluate(problem.reference), T)
    assert np.allclose(F_of(problem), T @ full.F.coefficient.evaluate(problem.reference) @ T.T, atol=1e-15)
    assert "C_bn" not in problem.model.needs
    assert [m.value for m in change.measures] == [0.0, 0.0]  # the simulated base does not turn


def test_remove_vertical_channel_alone(composed: Compose) -> None:
    problem, _, change = alone(composed, FLAT)
    assert change.removed_states == ("velocity_error[U]", "accel_bias[U]")
    assert change.removed_rows == ("zero_velocity[U]",)
    assert change.removed_noises == ("accel_noise[U]",)
    assert change.kind == "approximate"  # in b and with Coriolis the vertical pair acts on the level channels
    vertical = next(c for c in problem.checks if c.operation == "vertical_channel")
    assert (vertical.computed, vertical.equivalent) == (False, True)


def test_without_coriolis_and_with_biases_in_n_the_vertical_channel_is_lost_for_nothing(composed: Compose) -> None:
    problem = composed("static_12", policies(CORIOLIS, IN_N, FLAT), *TILTED)
    assert problem.changes[-1].kind == "exact"


def test_prune_unobservable_alone_in_b_leaves_an_observable_rest(composed: Compose) -> None:
    problem, _, change = alone(composed, PRUNE)
    assert len(change.removed_states) == 3
    assert all("bias" in s for s in change.removed_states)
    assert model_observability(problem.model, problem.reference).rank == 9


@pytest.mark.parametrize("latitude", [1, 5, 20, 34, 45, 60, 75, 85, -34, -85])
@ATTITUDES
def test_pruning_takes_level_accelerometers_and_the_east_gyro_at_any_latitude(
    composed: Compose, latitude: int, attitude: tuple[str, ...]
) -> None:
    problem = composed("static_7", f"site.latitude={latitude} deg", *attitude)
    assert problem.changes[-1].removed_states == ("accel_bias[E]", "accel_bias[N]", "gyro_bias[E]")
    assert np.array_equal(F_of(problem), eq16(problem))
