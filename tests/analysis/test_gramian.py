"""The square-root Gramian against the sum that it stands for, in exact fractions where that sum would lose digits."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.analysis.gramian import Gramian
from estimfw.errors import NumericalError

FloatArray = NDArray[np.float64]


Made = tuple[FloatArray, FloatArray, FloatArray, NDArray[np.bool_], FloatArray]


def random_steps(seed: int, n: int, m: int, steps: int) -> Made:
    rng = np.random.default_rng(seed)
    Phi = np.eye(n) + 0.1 * rng.standard_normal((steps, n, n))
    R = np.stack([a @ a.T + np.eye(m) for a in rng.standard_normal((steps, m, m))])
    usable: NDArray[np.bool_] = rng.random((steps, m)) < 0.7
    return Phi, rng.standard_normal((steps, m, n)), R, usable, rng.standard_normal((n, n))


@given(st.builds(random_steps, st.integers(0, 1000), st.integers(1, 4), st.integers(1, 3), st.integers(1, 8)))
def test_its_square_is_the_sum_over_the_steps(made: Made) -> None:
    Phi, H, R, usable, root = made
    gramian, wanted, A = Gramian(root), np.zeros_like(root), root
    gramian.add(Phi[:2], H[:2], R[:2], usable[:2])
    gramian.add(Phi[2:], H[2:], R[2:], usable[2:])
    for k in range(len(Phi)):
        A = Phi[k] @ A
        own = usable[k]
        rows = H[k][own] @ A
        wanted = wanted + rows.T @ np.linalg.solve(R[k][np.ix_(own, own)], rows)
    values = gramian.values()
    found = values.directions.T @ np.diag(values.singular**2) @ values.directions
    assert np.allclose(found, wanted, atol=1e-9 * max(1.0, float(np.abs(wanted).max())))
    assert np.allclose(gramian.transition, A)


def test_a_combination_known_ten_decades_less_is_still_told_apart() -> None:
    """Rows [1, 0] and [1, d]: the determinant of the sum is d^2, which 1 + d^2 in double precision has lost for d = 1e-10."""
    d = 1e-10
    gramian = Gramian(np.eye(2))
    H = np.array([[[1.0, 0.0], [1.0, d]]])
    gramian.add(np.eye(2)[None], H, np.eye(2)[None], np.ones((1, 2), dtype=bool))
    values = gramian.values()
    assert values.rank == 2
    exact = Fraction(d) ** 2
    assert np.prod(values.singular) ** 2 == pytest.approx(float(exact), rel=1e-4)
    assert np.linalg.matrix_rank(H[0].T @ H[0]) == 1


def test_sigma_shrinks_as_the_singular_values_say() -> None:
    """No process noise: the posterior of a Kalman filter has 1 / sqrt(1 + s^2) of each combination's prior sigma."""
    rng = np.random.default_rng(4)
    F, H, R, root = np.diag([0.5, 0.2], 1), rng.standard_normal((2, 3)), np.diag([0.5, 2.0]), np.diag([3.0, 1.0, 0.2])
    Phi, P, gramian = np.eye(3) + F, root @ root.T, Gramian(root)
    repeated = [np.broadcast_to(m, (5, *m.shape)) for m in (Phi, H, R)]
    gramian.add(repeated[0], repeated[1], repeated[2], np.ones((5, 2), dtype=bool))
    for _ in range(5):
        P = Phi @ P @ Phi.T
        P = P - P @ H.T @ np.linalg.inv(H @ P @ H.T + R) @ H @ P
    start = np.linalg.inv(gramian.transition) @ P @ np.linalg.inv(gramian.transition).T
    wanted = np.sort(np.sqrt(np.linalg.eigvalsh(start)))
    assert np.allclose(np.sort(1.0 / np.sqrt(1.0 + gramian.values().singular ** 2)), wanted, rtol=1e-8)


def test_nothing_measured_is_rank_zero() -> None:
    gramian = Gramian(np.eye(3))
    gramian.add(np.eye(3)[None], np.ones((1, 1, 3)), np.ones((1, 1, 1)), np.zeros((1, 1), dtype=bool))
    assert gramian.values().rank == gramian.values().informed == 0


def test_a_measurement_without_noise_tells_all_of_what_it_reads() -> None:
    gramian = Gramian(np.eye(2))
    gramian.add(np.eye(2)[None], np.eye(1, 2)[None], np.zeros((1, 1, 1)), np.ones((1, 1), dtype=bool))
    assert gramian.values().rank == 1
    assert gramian.values().singular[0] > 1e6


def test_dynamics_beyond_all_numbers_are_refused() -> None:
    gramian = Gramian(np.eye(1))
    Phi = np.full((40, 1, 1), 1e10)
    with pytest.raises(NumericalError, match="grow beyond all numbers"):
        gramian.add(Phi, np.ones((40, 1, 1)), np.ones((40, 1, 1)), np.ones((40, 1), dtype=bool))
