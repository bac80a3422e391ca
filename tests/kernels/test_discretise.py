"""Phi, Q and d against quadrature of their integrals, closed forms, and each other."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad_vec
from scipy.linalg import expm

from estimfw.errors import NumericalError
from estimfw.kernels import ud
from estimfw.kernels.discretise import held_noise, series, van_loan
from estimfw.plan.discretisation import MOST_DOUBLINGS, Discretisation
from tests.local_level_ins import matrices

FloatArray = NDArray[np.float64]
System = tuple[FloatArray, FloatArray, FloatArray]


def system(seed: int, n: int) -> System:
    rng = np.random.default_rng(seed)
    G = rng.standard_normal((n, max(1, n - 1)))
    return rng.standard_normal((n, n)) / n, G @ G.T, rng.standard_normal(n)


def integrals(F: FloatArray, D: FloatArray, b: FloatArray, dt: float) -> System:
    """Phi = exp(F dt), Q = int Phi(s) D Phi(s)' ds, d = int Phi(s) b ds."""

    def integrand(s: float, /) -> FloatArray:
        Phi = expm(F * s)
        return np.column_stack([Phi @ D @ Phi.T, Phi @ b])

    both, _ = quad_vec(integrand, 0.0, dt, epsabs=1e-13, epsrel=1e-12)
    total = np.asarray(both)
    return expm(F * dt), total[:, :-1], total[:, -1]


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 5), dt=st.floats(0.01, 2.0), doublings=st.integers(0, 3))
def test_van_loan_is_the_integral(seed: int, n: int, dt: float, doublings: int) -> None:
    F, D, b = system(seed, n)
    for found, expected in zip(van_loan(F, D, b, np.array(dt), doublings), integrals(F, D, b, dt), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 5), dt=st.floats(0.01, 2.0), doublings=st.integers(0, 3))
def test_held_noise_is_what_a_constant_rate_of_that_covariance_brings(
    seed: int, n: int, dt: float, doublings: int
) -> None:
    """x' = F x + w with w constant ends at (integral of Phi) w."""
    F, D, b = system(seed, n)

    def transition(s: float, /) -> FloatArray:
        return np.asarray(expm(F * s))

    Gamma = np.asarray(quad_vec(transition, 0.0, dt, epsabs=1e-13, epsrel=1e-12)[0])
    found = held_noise(F, D, b, np.array(dt), doublings)
    for made, expected in zip(found, (expm(F * dt), Gamma @ D @ Gamma.T / dt, Gamma @ b), strict=True):
        np.testing.assert_allclose(made, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_a_series_of_order_k_is_wrong_by_dt_to_the_k_plus_one(seed: int, order: int) -> None:
    F, D, b = system(seed, 3)
    errors = []
    for dt in (0.2, 0.1):
        made, exact = series(F, D, b, np.array(dt), order, order), van_loan(F, D, b, np.array(dt))
        errors.append([float(np.max(np.abs(m - e))) for m, e in zip(made, exact, strict=True)])
    for coarse, fine in zip(*errors, strict=True):
        assert coarse / fine == pytest.approx(2.0 ** (order + 1), rel=0.2)


def test_low_orders_are_those_that_papers_print() -> None:
    F, D, b = system(1, 4)
    dt = 0.5
    Phi, Q, d = series(F, D, b, np.array(dt), 2, 1)
    np.testing.assert_allclose(Phi, np.eye(4) + F * dt + F @ F * dt**2 / 2, rtol=1e-14)
    np.testing.assert_allclose(Q, D * dt, rtol=1e-14)
    np.testing.assert_allclose(d, b * dt + F @ b * dt**2 / 2, rtol=1e-13)


def test_leading_axes_of_time_and_dynamics_broadcast() -> None:
    systems = [system(seed, 3) for seed in (1, 2)]
    F, D, b = (np.stack(part) for part in zip(*systems, strict=True))
    dt = np.array([0.1, 0.4])
    exact, truncated = partial(van_loan, doublings=1), partial(series, phi_order=3, q_order=2, doublings=1)
    for method in (exact, truncated, partial(held_noise, doublings=1)):
        together = method(F, D, b, dt)
        for i in range(2):
            for found, alone in zip(together, method(*systems[i], dt[i]), strict=True):
                np.testing.assert_allclose(found[i], alone, rtol=1e-13, atol=1e-15)


def test_a_stiff_decay_is_cut_into_sub_steps_and_comes_out_right() -> None:
    # x' = -x / tau + w over 5000 tau: forgotten, and at its steady variance q tau / 2.
    tau, q = 1e-3, 4.0
    F, D, b = np.array([[-1.0 / tau]]), np.array([[q]]), np.array([2.0])
    doublings = Discretisation().doublings(F, 5.0)
    assert doublings == 13
    Phi, Q, d = van_loan(F, D, b, np.array(5.0), doublings)
    assert Phi[0, 0] == pytest.approx(0.0, abs=1e-300)
    assert Q[0, 0] == pytest.approx(q * tau / 2, rel=1e-10)
    assert d[0] == pytest.approx(2.0 * tau, rel=1e-10)


def test_slow_dynamics_are_not_cut() -> None:
    assert Discretisation().doublings(np.array([[0.0, 1.0], [-0.25, 0.0]]), 1.0) == 0


@pytest.mark.parametrize("rate", [2.0 * 2.0**MOST_DOUBLINGS, np.inf, np.nan])
def test_dynamics_too_stiff_for_sub_steps_are_refused(rate: float) -> None:
    with pytest.raises(NumericalError) as caught:
        Discretisation().doublings(np.array([[-rate]]), 1.5)
    assert caught.value.exit_code == 6
    assert ("too stiff for the step: |eigenvalue of F| x dt" if np.isfinite(rate) else "not finite") in str(
        caught.value
    )


def test_states_that_no_noise_reaches_have_none_to_the_last_bit() -> None:
    """A velocity with noise, its integral in units that make it tiny, a constant that drives both: the constant stays one.

    Roundings at the constant would be negative pivots in a factor of Q, and what stands above them in their column enormous.
    """
    F = np.array([[0.0, 0.0, 1.0], [1.6e-7, 0.0, 0.0], [0.0, 0.0, 0.0]])
    D = np.diag([1e-8, 0.0, 0.0])
    _, Q, _ = van_loan(F, D, np.zeros(3), np.array(1.0))
    np.testing.assert_array_equal(Q[2], 0.0)
    np.testing.assert_array_equal(Q[:, 2], 0.0)
    assert Q[1, 1] == pytest.approx(1e-8 * 1.6e-7**2 / 3.0, rel=1e-12)
    assert np.all(np.diag(ud.factor(Q)) >= 0.0)


def test_noise_reaches_states_through_others_with_leading_axes() -> None:
    F = np.zeros((2, 3, 3))
    F[0, 1, 0] = F[0, 2, 1] = 1.0
    D = np.broadcast_to(np.diag([1.0, 0.0, 0.0]), (2, 3, 3))
    _, Q, _ = van_loan(F, D, np.zeros((2, 3)), np.array(1.0))
    assert np.all(np.diag(Q[0]) > 0.0)
    np.testing.assert_allclose(Q[1], np.diag([1.0, 0.0, 0.0]), atol=1e-15)


@pytest.mark.parametrize("method", [van_loan, held_noise])
def test_what_no_noise_reaches_gets_none_not_even_a_rounding(method: Callable[..., System]) -> None:
    """Constants beside drifts: a factor of Q, with which noise is drawn, is that of Q."""
    F, D, _ = matrices("full14")
    _, Q, _ = method(F, D, np.zeros(14), np.array(10.0))
    assert np.array_equal(Q[6:11], np.zeros((5, 14)))
    form = ud.factor(Q)
    drawn = (np.triu(form, 1) + np.eye(14)) * np.sqrt(np.maximum(np.diag(form), 0.0))
    sigma = np.where(np.diag(Q) > 0.0, np.sqrt(np.diag(Q)), 1.0)
    assert np.max(np.abs(drawn @ drawn.T - Q) / np.outer(sigma, sigma)) < 1e-12
