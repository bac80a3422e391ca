"""Davenport's solution and the inertial path against independent ones."""

from __future__ import annotations

import numpy as np
import pytest
from estimfw_inertial.inertial_path import inertial_path, running_product
from estimfw_inertial.wahba import davenport
from scipy.spatial.transform import Rotation


@pytest.mark.parametrize("seed", range(10))
def test_davenport_agrees_with_the_singular_value_solution(seed: int) -> None:
    rng = np.random.default_rng(seed)
    observed = rng.standard_normal((20, 3))
    reference = Rotation.random(random_state=seed).apply(observed) + 0.3 * rng.standard_normal((20, 3))
    weight = rng.uniform(0.1, 2.0, 20)
    independent, _ = Rotation.align_vectors(reference, observed, weights=weight)
    assert davenport(reference, observed, weight) == pytest.approx(independent.as_matrix(), abs=1e-12)


@pytest.mark.parametrize("count", [1, 2, 3, 10, 101])
def test_the_running_product_agrees_with_one_after_the_other(count: int) -> None:
    turns = Rotation.random(count, random_state=count)
    total, expected = Rotation.identity(), []
    for turn in turns:
        total = total * turn
        expected.append(total.as_matrix())
    scalar_first = np.roll(turns.as_quat(), 1, axis=1)
    product = np.roll(running_product(scalar_first), -1, axis=1)
    assert Rotation.from_quat(product).as_matrix() == pytest.approx(np.array(expected), abs=1e-12)


def test_coning_is_compensated_to_the_order_of_the_step() -> None:
    """A body that cones: the attitude is known in closed form, uncompensated increments drift."""
    angle, rate, dt, count = 0.02, 2.0 * np.pi * 5.0, 0.005, 4000
    time = dt * np.arange(count + 1)
    zero = np.zeros_like(time)
    cone = Rotation.from_rotvec(angle * np.column_stack([np.cos(rate * time), np.sin(rate * time), zero]))
    dtheta = _coning_increments(angle, rate, time)
    C, _ = inertial_path(dtheta, np.zeros_like(dtheta))
    drift = (Rotation.from_matrix(C[-1]).inv() * cone[0].inv() * cone[-1]).magnitude()
    naive = Rotation.identity()
    for step in dtheta:
        naive = naive * Rotation.from_rotvec(step)
    uncompensated = (naive.inv() * cone[0].inv() * cone[-1]).magnitude()
    assert drift < 0.05 * uncompensated


def _coning_increments(angle: float, rate: float, time: np.ndarray) -> np.ndarray:
    """Integrals of the body rate of a coning motion: (-w sin(a) sin(wt), w sin(a) cos(wt), -w (1 - cos(a)))."""
    sine = np.sin(angle)
    path = np.column_stack([sine * np.cos(rate * time), sine * np.sin(rate * time), -rate * (1 - np.cos(angle)) * time])
    return np.diff(path, axis=0)
