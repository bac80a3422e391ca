"""Observability of systems that are constant in pieces, against the stacked matrices of Goshen-Meskin and Bar-Itzhack."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import expm, null_space

from estimfw.analysis.along_record import may_be_stripped
from estimfw.analysis.observability import LinearStretch, piecewise_observability

FloatArray = NDArray[np.float64]


def own_matrix(one: LinearStretch) -> FloatArray:
    rows = [one.H]
    for _ in range(one.F.shape[0] - 1):
        rows.append(rows[-1] @ one.F)
    return np.vstack(rows)


def total(stretches: Sequence[LinearStretch]) -> FloatArray:
    transition, blocks = np.eye(stretches[0].F.shape[0]), []
    for one in stretches:
        blocks.append(own_matrix(one) @ transition)
        transition = expm(one.F * one.duration) @ transition
    return np.vstack(blocks)


def pieces(seed: int, n: int, count: int, constants: int) -> list[LinearStretch]:
    """Sparse small integers; the first ``constants`` states are driven by none."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        F = np.where(rng.random((n, n)) < 0.3, rng.integers(-1, 2, (n, n)), 0).astype(float)
        F[:constants] = 0.0
        H = np.where(rng.random((1, n)) < 0.5, 1.0, 0.0)
        made.append(LinearStretch(F, H, 0.5))
    return made


systems = st.builds(pieces, st.integers(0, 10_000), st.integers(2, 4), st.integers(1, 3), st.integers(0, 4))


def same_space(a: FloatArray, b: FloatArray) -> bool:
    if a.shape[1] != b.shape[1]:
        return False
    return not a.size or int(np.linalg.matrix_rank(np.hstack([a, b]), tol=1e-6)) == a.shape[1]


@given(systems)
def test_rank_and_null_space_are_those_of_the_total_matrix(stretches: list[LinearStretch]) -> None:
    whole = total(stretches)
    found = piecewise_observability(stretches, np.eye(whole.shape[1]))
    assert found.rank == np.linalg.matrix_rank(whole, tol=1e-9)
    assert same_space(found.kernel, null_space(whole, rcond=1e-9))
    ranks = [np.linalg.matrix_rank(total(stretches[: k + 1]), tol=1e-9) for k in range(len(stretches))]
    assert np.cumsum([a.shape[1] for a in found.added]).tolist() == ranks


@given(systems)
def test_where_it_may_be_stripped_the_stripped_matrix_has_the_same_null_space(stretches: list[LinearStretch]) -> None:
    n = stretches[0].F.shape[0]
    assume(may_be_stripped(stretches, np.eye(n)))
    stripped = np.vstack([own_matrix(one) for one in stretches])
    assert same_space(piecewise_observability(stretches, np.eye(n)).kernel, null_space(stripped, rcond=1e-9))


def test_what_drifts_unseen_must_not_be_stripped() -> None:
    """y' = c goes on for 1 s unseen (only a is read), then y is read: y + c is known of the start, and not y."""
    F = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    stretches = [LinearStretch(F, np.eye(1, 3), 1.0), LinearStretch(0.0 * F, np.array([[0.0, 1.0, 0.0]]), 1.0)]
    assert not may_be_stripped(stretches, np.eye(3))
    kernel = piecewise_observability(stretches, np.eye(3)).kernel[:, 0]
    assert np.allclose(kernel / kernel[1], [0.0, 1.0, -1.0])


def test_a_second_attitude_makes_a_bias_observable() -> None:
    """Standing level, an accelerometer bias and a tilt cannot be told apart; after half a turn about the vertical they can."""
    g = 9.8
    level = np.array([[0.0, g, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    turned = np.array([[0.0, g, -1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    H, prior = np.array([[1.0, 0.0, 0.0]]), np.diag([1.0, 1e-2, 1e-3]) ** 2
    assert piecewise_observability([LinearStretch(level, H, 60.0)] * 2, prior).rank == 2
    assert piecewise_observability([LinearStretch(level, H, 60.0), LinearStretch(turned, H, 60.0)], prior).rank == 3
