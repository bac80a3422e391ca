"""UD and Joseph are the textbook filter: checked against one that is written here, with inverses and whole matrices."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.kernels import joseph, ud
from estimfw.kernels.fuse import FUSED, decorrelate, fuse

FloatArray = NDArray[np.float64]
SEEDS = st.integers(0, 2**32 - 1)
KERNELS = [pytest.param(ud, id="ud"), pytest.param(joseph, id="joseph")]


def covariance(rng: np.random.Generator, n: int) -> FloatArray:
    """Well away from singular, with states of very different size."""
    A = rng.standard_normal((n, n))
    size = 10.0 ** rng.uniform(-3, 3, n)
    return np.asarray(size[:, None] * (A @ A.T + 0.5 * np.eye(n)) * size)


def textbook(
    x: FloatArray, P: FloatArray, z: FloatArray, H: FloatArray, R: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """The update of all components at once, and the NIS."""
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    nu = z - H @ x
    return x + K @ nu, (np.eye(len(x)) - K @ H) @ P, float(nu @ np.linalg.solve(S, nu))


def scaled(difference: FloatArray, P: FloatArray) -> float:
    """Largest element of a matrix or vector difference in units of sigma."""
    sigma = np.sqrt(np.diag(P))
    return float(np.max(np.abs(difference / (np.outer(sigma, sigma) if difference.ndim == 2 else sigma))))


@pytest.mark.parametrize("kernel", KERNELS)
@given(seed=SEEDS, n=st.integers(1, 8))
def test_prediction_is_the_textbook_one(kernel: ModuleType, seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    P, Q = covariance(rng, n), np.zeros((n, n))
    driven = int(rng.integers(0, n + 1))
    Q[:driven, :driven] = covariance(rng, driven)
    Phi = np.eye(n) + rng.standard_normal((n, n)) * np.sqrt(np.diag(P))[:, None] / np.sqrt(np.diag(P))
    expected = Phi @ P @ Phi.T + Q
    found = kernel.covariance(kernel.predict(kernel.factor(P), Phi, Q))
    assert scaled(found - expected, expected) < 1e-9


@pytest.mark.parametrize("kernel", KERNELS)
@given(seed=SEEDS, n=st.integers(1, 8), m=st.integers(1, 4))
def test_a_vector_measurement_with_full_r_is_the_textbook_update(kernel: ModuleType, seed: int, n: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    x, P = rng.standard_normal(n), covariance(rng, n)
    H = rng.standard_normal((m, n)) / np.sqrt(np.diag(P))
    R, z = covariance(rng, m), rng.standard_normal(m)
    new_x, new_P, nis = textbook(x, P, z, H, R)
    done = fuse(kernel, x, kernel.factor(P), z, H, R, None)
    assert done.disposition == FUSED and done.used == m
    assert scaled(kernel.covariance(done.form) - new_P, P) < 1e-9
    assert scaled(done.x - new_x, P) < 1e-8 * (1.0 + np.sqrt(nis))
    assert done.nis == pytest.approx(nis, rel=1e-7)
    np.testing.assert_allclose(done.innovation, z - H @ x, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(done.sigma, np.sqrt(np.diag(H @ P @ H.T + R)), rtol=1e-9)


@given(seed=SEEDS)
def test_ud_and_joseph_agree_over_a_run(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    P0 = covariance(rng, n)
    sigma = np.sqrt(np.diag(P0))
    A = np.linalg.qr(rng.standard_normal((n, n)))[0]
    Phi, Q, H = sigma[:, None] * A / sigma, np.diag(0.01 * sigma**2), rng.standard_normal((2, n)) / sigma
    finals = []
    for kernel in (ud, joseph):
        x, form, drawn = np.zeros(n), kernel.factor(P0), np.random.default_rng(seed)
        for _ in range(40):
            x, form = Phi @ x, kernel.predict(form, Phi, Q)
            done = fuse(kernel, x, form, drawn.standard_normal(2), H, np.diag([0.1, 0.3]), None)
            x, form = done.x, done.form
        finals.append((x, kernel.covariance(form)))
    (x_ud, P_ud), (x_joseph, P_joseph) = finals
    assert scaled(P_ud - P_joseph, P_joseph) < 1e-9
    assert scaled(x_ud - x_joseph, P_joseph) < 1e-8


@given(seed=SEEDS, n=st.integers(1, 8))
def test_u_and_d_multiply_back_to_p(seed: int, n: int) -> None:
    P = covariance(np.random.default_rng(seed), n)
    form = ud.factor(P)
    assert np.all(np.diag(form) > 0.0)
    assert np.array_equal(np.tril(form, -1), np.zeros((n, n)))
    assert scaled(ud.covariance(form) - P, P) < 1e-12


def test_a_prior_without_uncertainty_in_some_direction_factors() -> None:
    P = np.outer([1.0, 2.0, -1.0], [1.0, 2.0, -1.0])
    np.testing.assert_allclose(ud.covariance(ud.factor(P)), P, atol=1e-14)


@given(seed=SEEDS, m=st.integers(1, 6))
def test_decorrelated_components_are_uncorrelated(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    R = covariance(rng, m)
    r, inverse = decorrelate(R, np.eye(m))
    whitened = inverse @ R @ inverse.T
    assert np.max(np.abs(whitened - np.diag(r)) / np.sqrt(np.outer(r, r))) < 1e-7
    assert np.array_equal(np.triu(inverse, 1), np.zeros((m, m)))


@pytest.mark.parametrize("kernel", KERNELS)
@given(seed=SEEDS)
def test_leading_axes_are_filters_side_by_side(kernel: ModuleType, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, m, runs = 4, 2, 3
    x, P = rng.standard_normal((runs, n)), np.stack([covariance(rng, n) for _ in range(runs)])
    z, H, R = rng.standard_normal((runs, m)), rng.standard_normal((runs, m, n)), covariance(rng, m)
    z[1, 0] = np.nan
    Phi, Q = rng.standard_normal((n, n)), covariance(rng, n)
    together = fuse(kernel, x, kernel.predict(kernel.factor(P), Phi, Q), z, H, np.broadcast_to(R, (runs, m, m)), None)
    for i in range(runs):
        alone = fuse(kernel, x[i], kernel.predict(kernel.factor(P[i]), Phi, Q), z[i], H[i], R, None)
        np.testing.assert_allclose(together.x[i], alone.x, rtol=1e-9)
        np.testing.assert_allclose(together.form[i], alone.form, rtol=1e-7, atol=1e-12 * np.max(np.abs(alone.form)))
        assert together.nis[i] == pytest.approx(float(alone.nis), rel=1e-9)
        assert (together.disposition[i], together.used[i]) == (alone.disposition, alone.used)
