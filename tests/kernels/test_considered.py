"""Considered states: Schmidt's filter by its definition, in both forms; and what is added to a covariance."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.kernels import joseph, ud
from estimfw.kernels.fuse import fuse

FloatArray = NDArray[np.float64]
RNG = np.random.default_rng(3)
ROOT = RNG.normal(size=(5, 5))
P, X = ROOT @ ROOT.T, RNG.normal(size=5)
CONSIDERED = np.array([False, False, True, False, True])


@pytest.mark.parametrize("kernel", [ud, joseph])
@pytest.mark.parametrize("c", [0.0, 2.5])
def test_a_column_is_added(kernel: ModuleType, c: float) -> None:
    v = np.asarray(RNG.normal(size=(3, 5)))
    v[1, 3] = 0.0
    made = kernel.covariance(kernel.added(kernel.factor(P), v, np.array(c)))
    np.testing.assert_allclose(made, P + c * v[:, :, None] * v[:, None, :], rtol=1e-12, atol=1e-13)
    flat = kernel.factor(np.diag([1.0, 0.0, 4.0, 0.0, 0.0]))
    made = kernel.covariance(kernel.added(flat, v[0], np.array(c)))
    np.testing.assert_allclose(made, np.diag([1.0, 0.0, 4.0, 0.0, 0.0]) + c * np.outer(v[0], v[0]), atol=1e-13)


def schmidt(x: FloatArray, P: FloatArray, z: FloatArray, H: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Scalar after scalar: the optimal gain without the rows of considered states, and Joseph's update with that gain."""
    for t, h, v in zip(z, H, r, strict=True):
        K = np.where(CONSIDERED, 0.0, P @ h / (h @ P @ h + v))
        A = np.eye(5) - np.outer(K, h)
        x, P = x + K * (t - h @ x), A @ P @ A.T + v * np.outer(K, K)
    return x, P


@pytest.mark.parametrize("kernel", [ud, joseph])
def test_considered_states_get_no_gain_and_the_covariance_says_so(kernel: ModuleType) -> None:
    H, z, R = RNG.normal(size=(3, 5)), RNG.normal(size=3), np.diag([0.3, 1.0, 2.0])
    done = fuse(kernel, X, kernel.factor(P), z, H, R, None, CONSIDERED.tolist())
    x, expected = schmidt(X, P, z, H, np.diag(R))
    np.testing.assert_allclose(done.x, x, rtol=1e-12)
    np.testing.assert_allclose(kernel.covariance(done.form), expected, rtol=1e-11, atol=1e-12)
    assert np.array_equal(done.x[CONSIDERED], X[CONSIDERED])


@pytest.mark.parametrize("kernel", [ud, joseph])
def test_where_they_do_not_stand_in_the_measurement_it_is_schmidts_vector_gain(kernel: ModuleType) -> None:
    """K_e = P_e H' S^-1 with the whole S, and P_ee as the optimal filter has it."""
    H, z = np.where(CONSIDERED, 0.0, RNG.normal(size=(2, 5))), RNG.normal(size=2)
    R = np.array([[1.0, 0.4], [0.4, 2.0]])
    done = fuse(kernel, X, kernel.factor(P), z, H, R, None, CONSIDERED.tolist())
    K = np.where(CONSIDERED[:, None], 0.0, P @ H.T @ np.linalg.inv(H @ P @ H.T + R))
    A = np.eye(5) - K @ H
    np.testing.assert_allclose(done.x, X + K @ (z - H @ X), rtol=1e-12)
    np.testing.assert_allclose(kernel.covariance(done.form), A @ P @ A.T + K @ R @ K.T, rtol=1e-11, atol=1e-12)
