"""Formulas for the noise of a step: their orders, their eigenvalues, and an exact reference that knows no exponential."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from estimfw.analysis.discretisation_study import FormulaStudy, study_discretisation
from estimfw.analysis.noise_formulas import FORMULAS, exact_noise
from estimfw.errors import NumericalError
from tests.local_level_ins import matrices

FloatArray = NDArray[np.float64]

STEPS = (1.0, 10.0, 60.0, 300.0)
INTEGRATOR = np.array([[0.0, 1.0], [0.0, 0.0]]), np.diag([0.0, 1.0])


@pytest.fixture(scope="module")
def studied() -> dict[str, FormulaStudy]:
    """The nine-state INS with Gauss-Markov drifts, by formula."""
    F, D, _ = matrices("gm9")
    found = study_discretisation([str(i) for i in range(9)], F, D, STEPS)
    return {one.formula.key: one for one in found.formulas}


@pytest.mark.parametrize(
    ("key", "order", "held_order"),
    [
        ("first", 2.0, 2.0),
        ("second", 2.99, 2.99),
        ("third_printed", 2.94, 3.99),
        ("third", 3.99, 2.94),
        ("held_noise", 2.94, np.nan),
        ("van_loan", np.nan, 2.94),
    ],
)
def test_orders_of_convergence(studied: dict[str, FormulaStudy], key: str, order: float, held_order: float) -> None:
    """Published orders of this model are reached within 5 %; nothing is told where only rounding is left."""
    assert studied[key].order == pytest.approx(order, rel=0.05, nan_ok=True)
    assert studied[key].held_order == pytest.approx(held_order, rel=0.05, nan_ok=True)


def test_the_second_order_is_no_covariance_and_the_printed_third_is_one_only_for_short_steps(
    studied: dict[str, FormulaStudy],
) -> None:
    at = dict(zip(STEPS, studied["second"].eigenvalue.tolist(), strict=True))
    assert at[10.0] == pytest.approx(-0.495, abs=5e-4)
    assert studied["second"].indefinite.all()
    printed = dict(zip(STEPS, studied["third_printed"].eigenvalue.tolist(), strict=True))
    assert 0.0 < printed[10.0] < 0.01 and printed[300.0] < -0.1
    assert not studied["van_loan"].indefinite.any() and not studied["held_noise"].indefinite.any()


def test_van_loan_is_exact_to_the_digits_of_a_float(studied: dict[str, FormulaStudy]) -> None:
    assert studied["van_loan"].own_error.max() < 1e-10


@pytest.mark.parametrize(
    ("key", "position"), [("van_loan", 1 / 3), ("third_printed", 1 / 4), ("held_noise", 1 / 4), ("second", 0.0)]
)
def test_the_double_integrator_after_one_second(key: str, position: float) -> None:
    """Variance of the position that white, or held, acceleration noise brings."""
    formula = next(one for one in FORMULAS if one.key == key)
    assert formula.noise(*INTEGRATOR, 1.0)[0, 0] == pytest.approx(position, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize("dt", [0.3, 4.0])
def test_the_exact_noises_are_their_definitions(dt: float) -> None:
    """Gauss-Legendre quadrature of the two integrals, for dynamics that turn, decay and grow."""
    rng = np.random.default_rng(5)
    F, root = rng.normal(size=(4, 4)), rng.normal(size=(4, 2))
    D = root @ root.T
    nodes, weights = np.polynomial.legendre.leggauss(40)
    Phi = expm(F * (0.5 * dt * (nodes + 1.0))[:, None, None])
    white = np.einsum("k,kij,jl,kml->im", 0.5 * dt * weights, Phi, D, Phi)
    Gamma = np.einsum("k,kij->ij", 0.5 * dt * weights, Phi)
    for found, wanted in zip(exact_noise(F, D, dt), (white, Gamma @ D @ Gamma.T / dt), strict=True):
        assert np.abs(found.astype(float) - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_steps_are_sorted_and_one_is_enough() -> None:
    found = study_discretisation("pv", *INTEGRATOR, [2.0, 1.0, 2.0])
    assert found.steps.tolist() == [1.0, 2.0]
    assert found.sigma[:, 0] == pytest.approx(np.sqrt([1 / 3, 8 / 3]))
    assert study_discretisation("pv", *INTEGRATOR, [1.0]).formulas[1].order == pytest.approx(3.0)


def test_a_step_beyond_all_numbers_is_refused() -> None:
    with pytest.raises(NumericalError, match="step of 1000 s is not finite"):
        study_discretisation("x", np.array([[5.0]]), np.array([[1.0]]), [1.0, 1000.0])
