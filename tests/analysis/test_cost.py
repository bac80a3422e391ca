"""Multiplications by formula are those that a number which counts its own products has made."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.analysis.cost import joseph_cost, predict_cost, rebuild_cost, ud_cost, update_cost
from estimfw.analysis.counted_number import Counted, Objects, Tally, counted, values_of
from estimfw.analysis.zero_pattern import OTHER, UNIT, ZERO, pattern_of, settled, transition_pattern
from estimfw.kernels import joseph, ud
from estimfw.plan.discretisation import Discretisation
from estimfw.plan.lowering import Lowered

Pattern = NDArray[np.int8]


def total(terms: list[Any], tally: Tally) -> Any:
    result = Counted(0.0, tally)
    for term in terms:
        result = result + term
    return result


def sparse_sum(kinds: Pattern, numbers: Objects, others: Objects, tally: Tally) -> Any:
    """sum of numbers * others without what is known to be zero; a one is no product."""
    terms = []
    for kind, a, b in zip(kinds, numbers, others, strict=True):
        if kind != ZERO:
            terms.append(b if kind == UNIT else a * b)
    return total(terms, tally)


def patterned(kinds: Pattern, seed: int) -> NDArray[np.float64]:
    free = np.random.default_rng(seed).normal(size=kinds.shape)
    return np.where(kinds == OTHER, free, (kinds == UNIT).astype(float))


def covariance(n: int, seed: int) -> NDArray[np.float64]:
    A = np.random.default_rng(seed).normal(size=(n, n))
    return np.asarray(A @ A.T + np.eye(n))


patterns = st.integers(1, 6).flatmap(
    lambda n: st.lists(st.lists(st.sampled_from([ZERO, UNIT, OTHER]), min_size=n, max_size=n), min_size=n, max_size=n)
)


@given(patterns, st.integers(0, 1000))
def test_prediction_by_pattern_takes_the_products_of_straight_line_code(rows: list[list[int]], seed: int) -> None:
    kinds = np.array(rows, dtype=np.int8)
    n = len(rows)
    Phi_values, P_values = patterned(kinds, seed), covariance(n, seed)
    counts = []
    for upper in (False, True):
        tally = Tally()
        Phi, P, x = (counted(a, tally) for a in (Phi_values, P_values, np.arange(1.0, n + 1.0)))
        new_x = [sparse_sum(kinds[i], Phi[i], x, tally) for i in range(n)]
        half = [[sparse_sum(kinds[i], Phi[i], P[:, j], tally) for j in range(n)] for i in range(n)]
        made = np.full((n, n), np.nan)
        for i in range(n):
            for j in range(n):
                if (j >= i) if upper else (j <= i):
                    made[i, j] = sparse_sum(kinds[j], Phi[j], np.array(half[i]), tally).value
        want = Phi_values @ P_values @ Phi_values.T
        known = np.isfinite(made)
        np.testing.assert_allclose(made[known], want[known], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose([one.value for one in new_x], Phi_values @ np.arange(1.0, n + 1.0), atol=1e-9)
        counts.append(tally.products)
    assert predict_cost(kinds) == min(counts)


@given(st.lists(st.sampled_from([ZERO, UNIT, OTHER]), min_size=1, max_size=7), st.integers(0, 1000))
def test_update_by_pattern_takes_the_products_of_straight_line_code(row: list[int], seed: int) -> None:
    kinds, n, tally = np.array(row, dtype=np.int8), len(row), Tally()
    h_values, P_values, r, z = patterned(kinds, seed), covariance(n, seed), 0.5, 1.3
    h, P, x = counted(h_values, tally), counted(P_values, tally), counted(np.ones(n), tally)
    innovation = Counted(z, tally) - sparse_sum(kinds, h, x, tally)
    Ph = np.array([sparse_sum(kinds, h, P[i], tally) for i in range(n)])
    s = sparse_sum(kinds, h, Ph, tally) + Counted(r, tally)
    K = np.array([one / s for one in Ph])
    new_x = np.array([a + k * innovation for a, k in zip(x, K, strict=True)])
    new_P = {(i, j): P[i, j] - K[i] * Ph[j] for i in range(n) for j in range(i + 1)}
    assert update_cost(kinds) == tally.products
    want_P, gain, _ = joseph.update(P_values, h_values, np.array(r))
    np.testing.assert_allclose(values_of(new_x), 1.0 + gain * (z - h_values.sum()), atol=1e-9)
    for (i, j), one in new_P.items():
        assert one.value == pytest.approx(want_P[i, j], abs=1e-9)


@pytest.mark.parametrize(("n", "rows", "dense", "selector"), [(10, 2, 2040, 1800), (20, 4, 15360, 13600)])
def test_dense_matrices_cost_what_the_symmetric_scalar_filter_is_known_to(
    n: int, rows: int, dense: int, selector: int
) -> None:
    # The specification of the gravimeter's alignment, section 3, "scalar, symmetric".
    full, one = np.full((n, n), OTHER, dtype=np.int8), np.eye(n, dtype=np.int8)[0] * UNIT
    assert predict_cost(full) + rows * update_cost(full[0]) == dense
    assert predict_cost(full) + rows * update_cost(one.astype(np.int8)) == selector


@pytest.mark.parametrize("n", [1, 2, 5, 8])
@pytest.mark.parametrize("rows", [0, 1, 3])
def test_dense_ud_kernel_takes_the_products_that_its_definition_has(n: int, rows: int) -> None:
    tally, rng = Tally(), np.random.default_rng(n)
    P, Q, Phi_values, H = covariance(n, 1), covariance(n, 2), rng.normal(size=(n, n)), rng.normal(size=(rows, n))
    form, noise = ud.factor(P), ud.factor(Q)
    U = counted(np.triu(form, 1) + np.eye(n), tally)
    Phi, x = counted(Phi_values, tally), counted(np.ones(n), tally)
    x = np.array([total([Phi[i, k] * x[k] for k in range(n)], tally) for i in range(n)])
    PhiU = [[total([Phi[i, k] * U[k, j] for k in range(n)], tally) for j in range(n)] for i in range(n)]
    W = np.concatenate([np.array(PhiU), counted(np.triu(noise, 1) + np.eye(n), tally)], axis=1)
    weight = counted(np.concatenate([np.diag(form), np.diag(noise)]), tally)
    U, D = _thornton(W, weight, tally)
    np.testing.assert_allclose(_product(U, D), Phi_values @ P @ Phi_values.T + Q, rtol=1e-9, atol=1e-9)
    want = _product(U, D)
    for h_values in H:
        x, U, D = _bierman(x, U, D, counted(h_values, tally), tally)
        want, _, _ = joseph.update(want, h_values, np.array(0.5))
    np.testing.assert_allclose(_product(U, D), want, rtol=1e-8, atol=1e-8)
    assert ud_cost(n, rows) == tally.products


def _product(U: Objects, D: Objects) -> NDArray[np.float64]:
    upper = np.triu(values_of(U), 1) + np.eye(len(D))
    return np.asarray(upper * values_of(D) @ upper.T)


def _thornton(W: Objects, weight: Objects, tally: Tally) -> tuple[Objects, Objects]:
    n, width = W.shape
    U, D = counted(np.eye(n), tally), counted(np.zeros(n), tally)
    for j in range(n - 1, -1, -1):
        c = [weight[k] * W[j, k] for k in range(width)]
        D[j] = total([W[j, k] * c[k] for k in range(width)], tally)
        for i in range(j):
            U[i, j] = total([W[i, k] * c[k] for k in range(width)], tally) / D[j]
            W[i] = [W[i, k] - U[i, j] * W[j, k] for k in range(width)]
    return U, D


def _bierman(x: Objects, U: Objects, D: Objects, h: Objects, tally: Tally) -> tuple[Objects, Objects, Objects]:
    n, alpha = len(x), Counted(0.5, tally)
    innovation = Counted(1.0, tally) - total([h[i] * x[i] for i in range(n)], tally)
    f = [total([U[i, j] * h[i] for i in range(n)], tally) for j in range(n)]
    v = [D[j] * f[j] for j in range(n)]
    b, U, D = counted(np.zeros(n), tally), U.copy(), D.copy()
    for j in range(n):
        before, alpha = alpha, alpha + f[j] * v[j]
        D[j] = D[j] * before / alpha
        pull = Counted(0.0, tally) - f[j] / before
        for i in range(j):
            U[i, j], b[i] = U[i, j] + b[i] * pull, b[i] + U[i, j] * v[j]
        b[j] = v[j]
    return np.array([x[i] + b[i] / alpha * innovation for i in range(n)]), U, D


@pytest.mark.parametrize(("n", "rows"), [(1, 1), (4, 0), (4, 3), (7, 2)])
def test_dense_joseph_kernel_takes_the_products_that_its_definition_has(n: int, rows: int) -> None:
    tally, rng = Tally(), np.random.default_rng(n)
    Phi_values, P_values, H = rng.normal(size=(n, n)), covariance(n, 1), rng.normal(size=(rows, n))
    Phi, P, x = counted(Phi_values, tally), counted(P_values, tally), counted(np.ones(n), tally)
    x = Phi @ x
    P = Phi @ P @ Phi.T
    want = Phi_values @ P_values @ Phi_values.T
    for h_values in H:
        h, r = counted(h_values, tally), Counted(0.5, tally)
        Ph = P @ h
        s = h @ Ph + r
        K = Ph / s
        A = P - np.outer(K, Ph)
        P = A - np.outer(A @ h, K) + np.outer(K * r, K)
        x = x + K * (Counted(1.0, tally) - h @ x)
        want, _, _ = joseph.update(want, h_values, np.array(0.5))
    np.testing.assert_allclose(values_of(P), want, rtol=1e-8, atol=1e-8)
    assert joseph_cost(n, rows) == tally.products


@given(patterns, st.integers(1, 3))
def test_pattern_of_phi_is_what_the_series_of_numbers_fills(rows: list[list[int]], order: int) -> None:
    F = np.array(rows) != ZERO
    numbers = np.where(F, 1.0, 0.0)  # no sum of positive numbers cancels
    Phi, power = np.eye(len(rows)), np.eye(len(rows))
    for _ in range(order):
        power = power @ numbers
        Phi = Phi + power
    kinds = transition_pattern(F, Discretisation("series", order))
    assert np.array_equal(kinds != ZERO, Phi != 0.0)
    assert np.array_equal(kinds == UNIT, (np.eye(len(rows)) == 1.0) & (Phi == 1.0))


def test_exact_discretisation_fills_what_any_power_reaches() -> None:
    chain = np.eye(5, k=1, dtype=bool)
    assert np.count_nonzero(transition_pattern(chain, Discretisation("van_loan"))) == 15
    assert np.count_nonzero(transition_pattern(chain, Discretisation("series", 2))) == 12


def test_what_varies_costs_its_coefficients_and_its_powers() -> None:
    # F = [[0, 2 a], [0, 3 b c]]: 1 + 2 products; F h: 2; F h @ F: F01 F11, F11 F11, then h / 2 on both: 4. D = [[0, 0], [0, d]]:
    # its one entry is the variable, and times h: 1.
    F = Lowered((2, 2), ((1, 2.0, (0,)), (3, 3.0, (1, 2))))
    D = Lowered((2, 2), ((3, 1.0, (3,)),))
    assert rebuild_cost(F, D, Discretisation("series", 2, 1)) == 3 + 2 + 4 + 1


def test_what_never_changes_is_a_number_and_may_be_nothing() -> None:
    known = np.array([0.0, 2.0, np.nan])
    matrix = Lowered((1, 4), ((0, 1.0, (0, 2)), (1, 0.5, (1,)), (2, 1.0, (1,)), (2, -2.0, ()), (3, 3.0, (1, 2))))
    left = settled(matrix, known)
    assert left.monomials == ((1, 1.0, ()), (3, 6.0, (2,)))
    assert pattern_of(left).tolist() == [[ZERO, UNIT, ZERO, OTHER]]
