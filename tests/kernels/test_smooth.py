"""The steps of a smoother: the compiled ones are the plain ones, links compose, and what is known stays known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.kernels import compiled_smooth, smooth, ud

FloatArray = NDArray[np.float64]
Links = tuple[FloatArray, FloatArray, FloatArray]


def updates(n: int, noises: int, known: int, steps: int = 40) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Factored covariances, transitions and noises of time updates."""
    draw = np.random.default_rng(n + 10 * noises)
    A = draw.normal(size=(steps, n, n))
    A[:, :known] = 0.0
    Phi = np.eye(n) + 0.1 * draw.normal(size=(steps, n, n))
    G = draw.normal(size=(steps, n, noises))
    return ud.factor(A @ np.swapaxes(A, -1, -2)), Phi, 0.1 * G @ np.swapaxes(G, -1, -2)


def links(n: int, noises: int, known: int) -> Links:
    form, Phi, Q = updates(n, noises, known)
    C, L = smooth.gain(form, Phi, Q)
    return C, np.random.default_rng(1).normal(size=(len(C), n)), L


CASES = [(1, 1, 0), (4, 2, 0), (5, 0, 0), (6, 1, 3), (7, 7, 0), (4, 1, 4), (14, 5, 2)]


@pytest.mark.parametrize(("n", "noises", "known"), CASES)
def test_compiled_steps_are_the_plain_ones(n: int, noises: int, known: int) -> None:
    plain, compiled = (kernel.gain(*updates(n, noises, known)) for kernel in (smooth, compiled_smooth))
    scale = np.maximum(1.0, np.max(np.abs(plain[0])))
    assert np.max(np.abs(plain[0] - compiled[0])) < 1e-10 * scale
    assert np.max(np.abs(ud.covariance(plain[1]) - ud.covariance(compiled[1]))) < 1e-12
    C, b, L = links(n, noises, known)
    one, other = (kernel.backward(C, b, L, b[0], L[0]) for kernel in (smooth, compiled_smooth))
    np.testing.assert_allclose(one[0], other[0], rtol=1e-10, atol=1e-10 * np.max(np.abs(one[0])))
    P, compiled_P = ud.covariance(one[1]), ud.covariance(other[1])
    np.testing.assert_allclose(compiled_P, P, rtol=1e-10, atol=1e-10 * np.max(P))


@pytest.mark.parametrize("kernel", [smooth, compiled_smooth], ids=["plain", "compiled"])
def test_composed_links_lead_to_the_same_place(kernel: object) -> None:
    C, b, L = links(4, 2, 0)
    whole = smooth.backward(C[:5], b[:5], L[:5], b[9], L[9])
    total = C[0], b[0], L[0]
    for k in range(1, 5):
        total = kernel.composed(total, (C[k], b[k], L[k]))  # type: ignore[attr-defined]
    u, forms = smooth.backward(total[0][None], total[1][None], total[2][None], b[9], L[9])
    np.testing.assert_allclose(u[0], whole[0][0], rtol=1e-9)
    np.testing.assert_allclose(ud.covariance(forms[0]), ud.covariance(whole[1][0]), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kernel", [smooth, compiled_smooth], ids=["plain", "compiled"])
def test_the_gain_is_that_of_the_textbook_where_it_has_an_inverse(kernel: object) -> None:
    form, Phi, Q = updates(5, 5, 0)
    P, Phi_t = ud.covariance(form), np.swapaxes(Phi, -1, -2)
    C = P @ Phi_t @ np.linalg.inv(Phi @ P @ Phi_t + Q)
    L = P - C @ (Phi @ P @ Phi_t + Q) @ np.swapaxes(C, -1, -2)
    found, rest = kernel.gain(form, Phi, Q)  # type: ignore[attr-defined]
    np.testing.assert_allclose(found, C, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(ud.covariance(rest), L, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("kernel", [smooth, compiled_smooth], ids=["plain", "compiled"])
def test_what_was_known_exactly_is_not_corrected(kernel: object) -> None:
    form, Phi, Q = updates(6, 2, 3)
    C, L = kernel.gain(form, Phi, Q)  # type: ignore[attr-defined]
    assert np.all(np.isfinite(C))
    assert np.max(np.abs(C[:, :3])) < 1e-12 and np.max(np.abs(ud.covariance(L)[:, :3])) < 1e-12
