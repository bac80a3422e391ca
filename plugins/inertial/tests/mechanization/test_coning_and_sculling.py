"""Coning and sculling: motions whose integral is known, and the errors that the literature gives for them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import j1

FloatArray = NDArray[np.float64]
Mechanized = Callable[..., FloatArray]

#: Neither Earth rate nor gravity, and a flat world: omega_ie cos L, omega_ie sin L, g, R_M + h, R_N + h, tan L.
NOWHERE = np.array([0.0, 0.0, 0.0, 1e12, 1e12, 0.0])
STILL = np.concatenate([np.eye(3).ravel(), np.zeros(6)])
TURN = 2.0 * np.pi


def coning(half_angle: float, steps_a_turn: int, turns: int, per_step: int) -> tuple[FloatArray, FloatArray]:
    """Increments (N, 6) of a body whose rotation vector, of constant length, goes round x, y once a second; and C at its start.

    Its rate is ``(-W sin a sin Wt, W sin a cos Wt, -2 W sin^2(a / 2))``.
    """
    count = steps_a_turn * per_step * turns
    edge = np.arange(count + 1)[:, None] / (steps_a_turn * per_step)
    across = np.sin(half_angle) * np.hstack([np.cos(TURN * edge), np.sin(TURN * edge)])
    along = -2.0 * TURN * np.sin(half_angle / 2.0) ** 2 * edge
    increments = np.diff(np.hstack([across, along, np.zeros((count + 1, 3))]), axis=0)
    return increments, Rotation.from_rotvec([half_angle, 0.0, 0.0]).as_matrix()


@pytest.mark.parametrize(
    ("per_step", "drift"),
    [
        (1, lambda a, x: a**2 * x**3 / 12.0),
        (2, lambda a, x: a**2 * x**5 / 960.0),
    ],
    ids=["one sample", "two samples"],
)
@pytest.mark.parametrize("steps_a_turn", [25, 50])
def test_the_drift_in_coning_is_the_known_one(
    mechanized: Mechanized, per_step: int, drift: Callable[[float, float], float], steps_a_turn: int
) -> None:
    """About the axis of the cone, a step of the angle x of the turn: Miller 1983; Savage 1998."""
    a, turns = np.radians(1.0), 20
    increments, C = coning(a, steps_a_turn, turns, per_step)
    start = np.concatenate([C.ravel(), np.zeros(6)])
    end = mechanized(start, increments, 1.0 / (steps_a_turn * per_step), per_step, frozenset(), NOWHERE)
    turned = Rotation.from_matrix(end[:9].reshape(3, 3) @ C.T).as_rotvec()
    expected = drift(a, TURN / steps_a_turn) * steps_a_turn * turns
    assert abs(turned[2]) == pytest.approx(expected, rel=0.05)
    assert np.abs(turned[:2]).max() < 0.05 * expected


def sculling(angle: float, steps_a_turn: int, turns: int, per_step: int) -> tuple[FloatArray, float]:
    """Increments (N, 6) of a body that swings about x as it is shaken along y, once a second, and V_U at the end.

    The angle is ``a sin Wt``, the specific force in b ``(0, sin Wt, 0)``: upwards ``sin Wt sin(a sin Wt)``, in the mean J_1(a).
    """
    count = steps_a_turn * per_step * turns
    edge = np.arange(count + 1)[:, None] / (steps_a_turn * per_step)
    zero = np.zeros((count + 1, 1))
    integrals = [angle * np.sin(TURN * edge), zero, zero, zero, -np.cos(TURN * edge) / TURN, zero]
    return np.diff(np.hstack(integrals), axis=0), float(j1(angle)) * turns


def sculling_error(mechanized: Mechanized, angle: float, steps_a_turn: int, per_step: int) -> float:
    """Of V_U in m/s per s."""
    increments, expected = sculling(angle, steps_a_turn, 20, per_step)
    computed = frozenset({"vertical_channel"})
    end = mechanized(STILL, increments, 1.0 / (steps_a_turn * per_step), per_step, computed, NOWHERE)
    return float(end[11] - expected) / 20.0


@pytest.mark.parametrize("angle", [0.001, 0.01])
def test_sculling_is_found(mechanized: Mechanized, angle: float) -> None:
    """Its mean upward force is J_1(a); two samples leave a 20 000th of it at 25 steps a turn."""
    assert abs(sculling_error(mechanized, angle, 25, 2)) < 5e-5 * j1(angle)


@pytest.mark.parametrize(("per_step", "order"), [(1, 2.0), (2, 4.0)])
def test_the_error_in_sculling_falls_with_the_known_power_of_the_step(
    mechanized: Mechanized, per_step: int, order: float
) -> None:
    coarse, fine = (sculling_error(mechanized, 0.001, steps, per_step) for steps in (20, 40))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.15)


def test_two_samples_are_exact_where_rate_and_force_grow_linearly(mechanized: Mechanized) -> None:
    """The compensation is derived for such a motion, to first order in the angle: what is left of V goes with its square."""

    def error(size: float) -> float:
        edge = np.array([0.0, 0.5, 1.0])[:, None]
        rate, slope = size * np.array([0.3, -0.2, 0.5]), size * np.array([-0.4, 0.6, 0.2])
        force, growth = np.array([1.0, -0.5, 0.8]), np.array([0.7, 0.9, -1.1])
        increments = np.diff(
            np.hstack([rate * edge + slope * edge**2 / 2.0, force * edge + growth * edge**2 / 2.0]), axis=0
        )
        fine = 1024
        t = (np.arange(fine) + 0.5) / fine
        turns = Rotation.from_rotvec((rate + slope * t[:, None]) / fine)
        C, V = Rotation.identity(), np.zeros(3)
        for k in range(fine):
            half = Rotation.from_rotvec(0.5 * turns[k].as_rotvec())
            V = V + (C * half).apply(force + growth * t[k]) / fine
            C = C * turns[k]
        computed = frozenset({"vertical_channel"})
        end = mechanized(STILL, increments, 0.5, 2, computed, NOWHERE)
        return float(np.linalg.norm(end[9:12] - V))

    assert np.log2(error(0.04) / error(0.02)) == pytest.approx(2.0, abs=0.1)
    assert error(0.02) < 0.02**2
