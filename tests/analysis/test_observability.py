"""Rank, unobservable directions, degrees and removable sets, against linear algebra done another way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.analysis.observability import LinearStretch, Observability, frozen_observability
from estimfw.analysis.removable import least_determined_removable

FloatArray = NDArray[np.float64]


def stacked_rank(F: FloatArray, H: FloatArray) -> int:
    """Rank of [H; HF; HF^2 ...] as it stands in the textbook: right where all entries are of order one."""
    blocks = [H]
    for _ in range(F.shape[0] - 1):
        blocks.append(blocks[-1] @ F)
    return int(np.linalg.matrix_rank(np.vstack(blocks), tol=1e-9))


def conditioned_sigma(kernel: FloatArray, P: FloatArray) -> FloatArray:
    """Sigma of x ~ N(0, P) given the part of x that a kernel leaves observable, by the Gaussian formula.

    Known exactly: y = A x with A spanning what is orthogonal to the kernel.
    """
    A = np.linalg.svd(kernel.T)[2][kernel.shape[1] :]
    gain = P @ A.T @ np.linalg.inv(A @ P @ A.T)
    return np.asarray(np.sqrt(np.clip(np.diag(P - gain @ A @ P), 0.0, None)))


def taken(found: Observability, F: FloatArray, H: FloatArray, P: FloatArray, protected: list[bool]) -> list[int] | None:
    chosen = least_determined_removable(found, [LinearStretch(F, H)], P, protected)
    return None if chosen is None else list(chosen)


def system(seed: int, n: int, unseen: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """F, H, P and a basis of what is unobservable: a random similarity of a block-triangular pair."""
    rng = np.random.default_rng(seed)
    F = rng.normal(size=(n, n)) / np.sqrt(n)
    H = rng.normal(size=(2, n))
    F[: n - unseen, n - unseen :] = 0.0
    H[:, n - unseen :] = 0.0
    T = np.linalg.qr(rng.normal(size=(n, n)))[0]
    root = rng.normal(size=(n, n))
    return T @ F @ T.T, H @ T.T, root @ root.T + 0.1 * np.eye(n), T[:, n - unseen :]


systems = st.builds(system, st.integers(0, 500), st.integers(3, 7), st.integers(0, 2))


@given(systems)
def test_rank_and_kernel_are_those_of_the_stacked_matrix(made: tuple[FloatArray, ...]) -> None:
    F, H, P, unseen = made
    found = frozen_observability(F, H, P)
    assert found.rank == stacked_rank(F, H) == F.shape[0] - unseen.shape[1]
    assert np.linalg.matrix_rank(np.hstack([found.kernel, unseen]), tol=1e-6) == unseen.shape[1]


@given(systems)
def test_the_degree_is_the_conditioned_sigma_over_the_prior_sigma(made: tuple[FloatArray, ...]) -> None:
    F, H, P, unseen = made
    found = frozen_observability(F, H, P)
    wanted = conditioned_sigma(unseen, P) / np.sqrt(np.diag(P)) if unseen.shape[1] else np.zeros(F.shape[0])
    assert np.allclose(found.degree, wanted, atol=1e-6)


def chain(n: int, coupling: float) -> tuple[FloatArray, FloatArray]:
    """x_0' = coupling x_1, x_1' = coupling x_2 ...; x_0 is read."""
    return np.diag(np.full(n - 1, coupling), 1), np.eye(1, n)


@pytest.mark.parametrize("coupling", [1e-12, 1e-5, 1.0, 1e6])
def test_the_size_of_a_coupling_does_not_hide_a_state(coupling: float) -> None:
    """A gyro bias acts on velocity by way of 1e-8: it is observable all the same."""
    F, H = chain(5, coupling)
    assert frozen_observability(F, H, np.eye(5)).rank == 5


def test_units_play_no_part() -> None:
    F, H, P, _ = system(3, 6, 2)
    units = np.diag([1.0, 1e-8, 1e6, 1e-3, 1e4, 1e-6])
    scaled = frozen_observability(units @ F @ np.linalg.inv(units), H @ np.linalg.inv(units), units @ P @ units)
    plain = frozen_observability(F, H, P)
    assert scaled.rank == plain.rank
    assert np.allclose(scaled.degree, plain.degree, atol=1e-8)


def test_without_a_measurement_nothing_is_known() -> None:
    found = frozen_observability(np.zeros((3, 3)), np.zeros((0, 3)), np.diag([1.0, 4.0, 9.0]))
    assert found.rank == 0
    assert np.allclose(found.degree, 1.0)


NOTHING, SUM = np.zeros((3, 3)), np.ones((1, 3))
"""z = x0 + x1 + x2 of three constants."""


def test_ties_go_by_state_order() -> None:
    """Any two could go, and all are alike."""
    found = frozen_observability(NOTHING, SUM, np.eye(3))
    assert taken(found, NOTHING, SUM, np.eye(3), [False] * 3) == [0, 1]


def test_the_least_determined_go_first() -> None:
    """Of the sum known, the widest prior is left widest, over its own width."""
    P = np.diag([1.0, 100.0, 0.01])
    found = frozen_observability(NOTHING, SUM, P)
    assert np.allclose(found.degree, conditioned_sigma(found.kernel, P) / np.sqrt(np.diag(P)), atol=1e-12)
    assert taken(found, NOTHING, SUM, P, [False] * 3) == [0, 2]


def test_protected_states_are_never_touched() -> None:
    found = frozen_observability(NOTHING, SUM, np.eye(3))
    assert taken(found, NOTHING, SUM, np.eye(3), [True, False, False]) == [1, 2]
    assert taken(found, NOTHING, SUM, np.eye(3), [True, True, False]) is None


def test_a_state_that_is_known_beforehand_counts_in_its_unit() -> None:
    """A prior sigma of zero divides nothing by zero."""
    F, H = chain(3, 1.0)
    found = frozen_observability(F, H, np.diag([1.0, 0.0, 1.0]))
    assert found.rank == 3
    assert np.all(np.isfinite(found.degree))
