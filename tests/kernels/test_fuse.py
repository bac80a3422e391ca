"""What becomes of a measurement: masked components, the gate, what is refused, and what stays positive."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from estimfw.kernels import joseph, ud
from estimfw.kernels.fuse import FUSED, GATED, INVALID, MEANINGS, MISSING, fuse

KERNELS = [pytest.param(ud, id="ud"), pytest.param(joseph, id="joseph")]
P = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -1.0], [0.5, -1.0, 1.0]])
X = np.array([1.0, -2.0, 0.5])
H = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 2.0]])
R = np.array([[1.0, 0.3, 0.2], [0.3, 2.0, -0.4], [0.2, -0.4, 0.5]])
Z = np.array([2.0, -1.0, 3.0])


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("lost", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("component", [0, 1, 2])
def test_a_component_that_is_no_number_is_skipped_and_the_rest_fused(
    kernel: ModuleType, lost: float, component: int
) -> None:
    z = Z.copy()
    z[component] = lost
    rest = [i for i in range(3) if i != component]
    done = fuse(kernel, X, kernel.factor(P), z, H, R, None)
    only = fuse(kernel, X, kernel.factor(P), Z[rest], H[rest], R[np.ix_(rest, rest)], None)
    assert (int(done.disposition), int(done.used)) == (FUSED, 2)
    np.testing.assert_allclose(done.x, only.x, rtol=1e-13)
    np.testing.assert_allclose(kernel.covariance(done.form), kernel.covariance(only.form), rtol=1e-13, atol=1e-14)
    assert done.nis == pytest.approx(float(only.nis), rel=1e-13)
    assert np.isnan(done.innovation[component]) and np.isnan(done.sigma[component])
    assert np.all(np.isfinite(done.innovation[rest])) and np.all(np.isfinite(done.sigma[rest]))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("usable", [[0, 1, 2], [0, 2], [1]])
def test_log_det_is_that_of_the_innovation_covariance_of_what_was_fused(kernel: ModuleType, usable: list[int]) -> None:
    z = np.full(3, np.nan)
    z[usable] = Z[usable]
    sign, expected = np.linalg.slogdet((H @ P @ H.T + R)[np.ix_(usable, usable)])
    done = fuse(kernel, X, kernel.factor(P), z, H, R, None)
    assert sign == 1.0
    assert done.log_det == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("kernel", KERNELS)
def test_log_det_is_told_of_a_gated_measurement_too_and_of_no_other(kernel: ModuleType) -> None:
    form = kernel.factor(P)
    gated = fuse(kernel, X, form, Z, H, R, np.full(4, 1e-9))
    assert gated.disposition == GATED
    assert gated.log_det == pytest.approx(np.linalg.slogdet(H @ P @ H.T + R)[1], rel=1e-13)
    missing = fuse(kernel, X, form, np.full(3, np.nan), H, R, None)
    invalid = fuse(kernel, X, kernel.factor(np.zeros((3, 3))), Z, H, np.zeros((3, 3)), None)
    assert [int(d.disposition) for d in (missing, invalid)] == [MISSING, INVALID]
    assert np.isnan(missing.log_det) and np.isnan(invalid.log_det)


@pytest.mark.parametrize("kernel", KERNELS)
def test_nothing_usable_is_missing_and_changes_nothing(kernel: ModuleType) -> None:
    form = kernel.factor(P)
    done = fuse(kernel, X, form, np.full(3, np.nan), H, R, np.zeros(4))
    assert (int(done.disposition), int(done.used)) == (MISSING, 0)
    assert np.isnan(done.nis)
    np.testing.assert_array_equal(done.x, X)
    np.testing.assert_array_equal(done.form, form)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize(("factor", "expected"), [(1.0 - 1e-9, FUSED), (1.0 + 1e-9, GATED)])
def test_the_gate_is_at_the_chi_square_quantile_of_the_usable_components(
    kernel: ModuleType, factor: float, expected: int
) -> None:
    thresholds = np.concatenate([[0.0], chi2.ppf(0.99, [1, 2, 3])])
    usable = [0, 2]
    S = (H @ P @ H.T + R)[np.ix_(usable, usable)]
    direction = np.linalg.cholesky(S) @ np.array([0.6, 0.8])
    z = H @ X + np.array([direction[0], np.nan, direction[1]]) * np.sqrt(thresholds[2] * factor)
    form = kernel.factor(P)
    done = fuse(kernel, X, form, z, H, R, thresholds)
    assert done.disposition == expected
    assert done.nis == pytest.approx(thresholds[2] * factor, rel=1e-12)
    if expected == GATED:
        assert done.used == 0
        np.testing.assert_array_equal(done.x, X)
        np.testing.assert_array_equal(done.form, form)


@pytest.mark.parametrize("kernel", KERNELS)
def test_without_a_gate_an_outlier_is_fused(kernel: ModuleType) -> None:
    done = fuse(kernel, X, kernel.factor(P), Z + 1e6, H, R, None)
    assert done.disposition == FUSED and done.nis > 1e9


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_singular_innovation_covariance_skips_the_update(kernel: ModuleType) -> None:
    # Two perfect readings of one state: after the first nothing is uncertain, so the second could only divide by rounding.
    twice = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    form = kernel.factor(P)
    done = fuse(kernel, X, form, np.array([1.5, 1.6]), twice, np.zeros((2, 2)), None)
    assert (int(done.disposition), int(done.used)) == (INVALID, 0)
    np.testing.assert_array_equal(done.x, X)
    np.testing.assert_array_equal(done.form, form)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_perfect_reading_of_a_known_state_is_invalid(kernel: ModuleType) -> None:
    done = fuse(kernel, X, kernel.factor(np.zeros((3, 3))), Z, H, np.zeros((3, 3)), None)
    assert done.disposition == INVALID


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_perfect_reading_is_believed(kernel: ModuleType) -> None:
    done = fuse(kernel, X, kernel.factor(P), Z[:1], H[:1], np.zeros((1, 1)), None)
    assert done.disposition == FUSED
    assert done.x[0] == pytest.approx(Z[0], rel=1e-14)
    assert kernel.covariance(done.form)[0, 0] == pytest.approx(0.0, abs=1e-14)


@given(
    exponents=st.tuples(st.floats(2, 12), st.floats(-12, -2), st.floats(-12, -2)),
    together=st.booleans(),
)
def test_ud_stays_positive_under_two_tiny_r_and_a_huge_p(exponents: tuple[float, float, float], together: bool) -> None:
    p, r1, r2 = (10.0**e for e in exponents)
    prior = p * np.array([[1.0, 0.5], [0.5, 1.0]])
    rows, noise, z = np.array([[1.0, 1.0], [1.0, 1.0]]), np.diag([r1, r2]), np.array([3.0, 3.0])
    x, form = np.zeros(2), ud.factor(prior)
    pieces = [slice(0, 2)] if together else [slice(0, 1), slice(1, 2)]
    for own in pieces:
        done = fuse(ud, x, form, z[own], rows[own], noise[own, own], None)
        assert done.disposition == FUSED
        x, form = done.x, done.form
    assert np.all(np.diag(form) > 0.0)
    # The information adds up: along the common row the variance is that of the two readings together.
    spread = float(ud.projected(form, rows[:1])[0, 0])
    assert spread == pytest.approx(1.0 / (1.0 / r1 + 1.0 / r2), rel=1e-2)
    assert x.sum() == pytest.approx(3.0, abs=1e-3)


def test_where_ud_stays_positive_the_textbook_form_does_not() -> None:
    # The claim above would be empty if the numbers were easy.
    x, prior, r, row = np.zeros(2), 1e12 * np.array([[1.0, 0.3], [0.3, 1.0]]), 1e-10, np.array([1.0, 0.7])
    covariance, form = prior, ud.factor(prior)
    for _ in range(2):
        s = row @ covariance @ row + r
        K = covariance @ row / s
        covariance = covariance - np.outer(K, row @ covariance)
        form = fuse(ud, x, form, np.array([3.0]), row[None], np.array([[r]]), None).form
    exact = r / 2.0
    U, D = np.triu(form, 1) + np.eye(2), np.diag(form)
    assert float(np.sum((row @ U) ** 2 * D)) == pytest.approx(exact, rel=1e-3)
    assert abs(float(row @ covariance @ row) - exact) > exact


def test_words_of_dispositions() -> None:
    assert MEANINGS == ("fused", "gated", "late", "missing", "invalid")
