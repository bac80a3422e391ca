"""Phi, Q and d against scipy's exponential of the augmented matrix, quadrature, and the series' own order."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from estimfw.errors import NumericalError
from estimfw.plan.discretisation import Discretisation

FloatArray = NDArray[np.float64]
RNG = np.random.default_rng(11)
F = RNG.normal(size=(4, 4))
ROOT = RNG.normal(size=(4, 4))
D = ROOT @ ROOT.T
B = RNG.normal(size=4)


def by_quadrature(dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Phi, Q = int Phi(s) D Phi(s)' ds, d = int Phi(s) b ds: the definitions."""
    nodes, weights = np.polynomial.legendre.leggauss(20)  # exact to rounding for a smooth integrand
    times = 0.5 * dt * (nodes + 1.0)
    Phi = expm(F * times[:, None, None])
    Q = np.einsum("k,kij,jl,kml->im", 0.5 * dt * weights, Phi, D, Phi)
    d = np.einsum("k,kij,j->i", 0.5 * dt * weights, Phi, B)
    return expm(F * dt), Q, d


def by_augmentation(dt: float) -> tuple[FloatArray, FloatArray]:
    """Phi and Q from one exponential of [[F, D], [0, -F']], the other arrangement of Van Loan's."""
    block = np.block([[F, D], [np.zeros((4, 4)), -F.T]])
    whole = expm(block * dt)
    Phi = whole[:4, :4]
    return Phi, whole[:4, 4:] @ Phi.T


@pytest.mark.parametrize("dt", [1e-3, 0.1, 1.0])
@pytest.mark.parametrize("doublings", [0, 3])
def test_van_loan_is_exact(dt: float, doublings: int) -> None:
    made = Discretisation("van_loan").apply(F, D, B, np.array(dt), doublings)
    for got, wanted in zip(made, by_quadrature(dt), strict=True):
        assert np.allclose(got, wanted, rtol=1e-11, atol=1e-12 * np.abs(wanted).max())
    for got, wanted in zip(made, by_augmentation(dt), strict=False):
        assert np.allclose(got, wanted, rtol=1e-11, atol=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_a_series_errs_by_one_order_more_than_it_has(order: int) -> None:
    """Halving the step divides the error of Phi, Q and d by 2**(order + 1)."""
    series = Discretisation("series", phi_order=order, q_order=order)

    def errors(dt: float) -> list[float]:
        made = series.apply(F, D, B, np.array(dt), 0)
        return [float(np.abs(g - w).max()) for g, w in zip(made, by_quadrature(dt), strict=True)]

    for coarse, fine in zip(errors(0.02), errors(0.01), strict=True):
        assert coarse / fine == pytest.approx(2.0 ** (order + 1), rel=0.1)


def test_the_papers_settings_are_its_formulas() -> None:
    """Phi = I + F dt + (F dt)^2 / 2, Q = D dt."""
    dt = 0.3
    Phi, Q, _ = Discretisation("series", phi_order=2, q_order=1).apply(F, D, B, np.array(dt), 0)
    assert np.allclose(Phi, np.eye(4) + F * dt + (F * dt) @ (F * dt) / 2.0, rtol=1e-14, atol=1e-15)
    assert np.allclose(Q, D * dt, rtol=1e-15)


def test_the_second_order_of_Q() -> None:
    dt = 0.3
    _, Q, _ = Discretisation("series", phi_order=2, q_order=2).apply(F, D, B, np.array(dt), 0)
    assert np.allclose(Q, D * dt + (F @ D + D @ F.T) * dt**2 / 2.0, rtol=1e-13)


@pytest.mark.parametrize("method", ["van_loan", "series"])
@pytest.mark.parametrize("doublings", [0, 2])
def test_many_intervals_at_once_are_one_after_the_other(method: Literal["van_loan", "series"], doublings: int) -> None:
    setting = Discretisation(method, 3, 2)
    factors = np.array([1.0, -0.5, 2.0])
    dt = np.array([0.1, 0.2, 0.05])
    many = setting.apply(
        F * factors[:, None, None], D * factors[:, None, None] ** 2, B * factors[:, None], dt, doublings
    )
    for k, f in enumerate(factors):
        one = setting.apply(F * f, D * f**2, B * f, dt[k], doublings)
        for stacked, single in zip(many, one, strict=True):
            assert np.allclose(stacked[k], single, rtol=1e-13, atol=1e-15)


def test_one_F_serves_many_steps() -> None:
    dt = np.array([0.1, 0.2])
    Phi, Q, d = Discretisation().apply(F, D, B, dt, 0)
    assert Phi.shape == Q.shape == (2, 4, 4)
    assert d.shape == (2, 4)


@pytest.mark.parametrize("method", ["van_loan", "series"])
def test_Q_is_symmetric_and_positive(method: Literal["van_loan", "series"]) -> None:
    thin = np.outer(B, B)
    _, Q, _ = Discretisation(method, 2, 1).apply(F, thin, B, np.array(0.5), 0)
    assert np.array_equal(Q, Q.T)
    assert np.linalg.eigvalsh(Q).min() > -1e-14


@pytest.mark.parametrize(("rate", "times"), [(0.9, 0), (1.1, 1), (2.1, 2), (1000.0, 10)])
def test_sub_steps_are_short_against_the_fastest_mode(rate: float, times: int) -> None:
    assert Discretisation().doublings(np.diag([-rate, -0.1]), 1.0) == times
    assert Discretisation().doublings(rate * np.array([[0.0, 1.0], [-1.0, 0.0]]), 1.0) == times


def test_a_chain_of_integrators_is_not_stiff() -> None:
    """Large couplings without feedback: every eigenvalue is 0."""
    assert Discretisation().doublings(np.diag([1e3, 1e3], 1), 1.0) == 0


def stiff(rate: float) -> FloatArray:
    return np.array([[-rate, 1.0], [0.0, -0.1]])


@pytest.mark.parametrize("method", ["van_loan", "series"])
def test_stiff_dynamics_decay_with_sub_steps(method: Literal["van_loan", "series"]) -> None:
    """rate x dt = 500: without sub-steps a series explodes, and exp(+F' dt) overflows Van Loan's block."""
    rate, dt = 1000.0, 0.5
    F_stiff, D_stiff = stiff(rate), np.diag([4.0, 1.0])
    setting = Discretisation(method, 12, 12)
    times = setting.doublings(F_stiff, dt)
    Phi, Q, _ = setting.apply(F_stiff, D_stiff, np.zeros(2), np.array(dt), times)
    assert times == 9
    assert np.allclose(Phi, expm(F_stiff * dt), atol=1e-9)
    slow = float(np.exp(-0.1 * dt))
    fast_mode, by_the_slow_one = 4.0 / (2.0 * rate), (1.0 - slow**2) / 0.2 / (rate - 0.1) ** 2
    assert Q[0, 0] == pytest.approx(fast_mode + by_the_slow_one, rel=1e-5)


def test_a_series_without_sub_steps_would_not_do() -> None:
    Phi, _, _ = Discretisation("series", 4, 4).apply(stiff(1000.0), np.eye(2), np.zeros(2), np.array(0.5), 0)
    assert np.abs(Phi).max() > 1e9


def test_too_stiff_a_model_is_refused_with_its_number() -> None:
    with pytest.raises(NumericalError, match=r"too stiff for the step: .* = 1e\+07 \(dt = 10 s\)") as caught:
        Discretisation().doublings(stiff(1e6), 10.0)
    assert "shorten the step" in str(caught.value)
    with pytest.raises(NumericalError, match="not finite"):
        Discretisation().doublings(np.array([[np.nan]]), 1.0)


def test_what_it_does_is_told() -> None:
    assert Discretisation().describe() == "Van Loan, process terms at the middle of the interval"
    told = Discretisation("series", 2, 1, "start").describe()
    assert told == "series, Phi to order 2 and Q to order 1, process terms at the start of the interval"
