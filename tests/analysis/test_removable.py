"""Minimal sets whose removal makes the rest observable, against a search over all sets with the textbook's rank."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.analysis import removable
from estimfw.analysis.observability import LinearStretch, frozen_observability
from estimfw.analysis.removable import least_determined, least_determined_removable, removable_sets, undriven

FloatArray = NDArray[np.float64]
Sets = set[tuple[int, ...]]


def stacked_rank(F: FloatArray, H: FloatArray) -> int:
    blocks = [H]
    for _ in range(F.shape[0] - 1):
        blocks.append(blocks[-1] @ F)
    return int(np.linalg.matrix_rank(np.vstack(blocks), tol=1e-9))


def by_exhaustion(F: FloatArray, H: FloatArray, protected: list[bool]) -> Sets:
    """All sets of at most n - rank unprotected states whose loss leaves full rank, without those that hold another."""
    n, found = F.shape[0], list[set[int]]()
    free = [i for i in range(n) if not protected[i]]
    for size in range(1, n - stacked_rank(F, H) + 1):
        for gone in combinations(free, size):
            kept = [i for i in range(n) if i not in gone]
            if any(s <= set(gone) for s in found) or not kept:
                continue
            if stacked_rank(F[np.ix_(kept, kept)], H[:, kept]) == len(kept):
                found.append(set(gone))
    return {tuple(sorted(s)) for s in found}


def small_integers(seed: int, constants: int, driven: int, rows: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sparse integer F (constants first) and H, which often lack rank, and a prior."""
    rng = np.random.default_rng(seed)
    n = constants + driven
    F = np.where(rng.random((n, n)) < 0.4, rng.integers(-2, 3, (n, n)), 0).astype(float)
    F[:constants] = 0.0
    H = np.where(rng.random((rows, n)) < 0.5, rng.integers(-2, 3, (rows, n)), 0).astype(float)
    return F, H, np.diag(rng.uniform(0.5, 2.0, n) ** 2)


pairs = st.builds(small_integers, st.integers(0, 10_000), st.integers(0, 4), st.integers(1, 3), st.integers(0, 2))


@given(pairs, st.integers(0, 2))
def test_the_sets_are_those_of_a_search_over_all_sets(made: tuple[FloatArray, ...], guarded: int) -> None:
    F, H, P = made
    protected = [i < guarded for i in range(F.shape[0])]
    found = frozen_observability(F, H, P)
    sets = removable_sets(found, [LinearStretch(F, H)], P, protected)
    assert sets.complete
    assert set(sets.sets) == by_exhaustion(F, H, protected)


@given(pairs)
def test_the_set_to_delete_is_the_first_of_the_sets(made: tuple[FloatArray, ...]) -> None:
    F, H, P = made
    found, stretches = frozen_observability(F, H, P), [LinearStretch(F, H)]
    sets = removable_sets(found, stretches, P, [False] * F.shape[0]).sets
    chosen = least_determined_removable(found, stretches, P, [False] * F.shape[0])
    if found.kernel.shape[1]:
        assert chosen == least_determined(sets, found.degree) == (sets[0] if sets else None)


@given(st.builds(small_integers, st.integers(0, 10_000), st.integers(2, 6), st.just(0), st.integers(1, 2)))
def test_of_constants_the_set_of_the_largest_sum_of_degrees_goes(made: tuple[FloatArray, ...]) -> None:
    F, H, P = made
    found, stretches = frozen_observability(F, H, P), [LinearStretch(F, H)]
    sets = by_exhaustion(F, H, [False] * F.shape[0])
    chosen = least_determined_removable(found, stretches, P, [False] * F.shape[0])
    if sets:
        assert chosen is not None
        best = max(found.degree[list(s)].sum() for s in sets)
        assert found.degree[list(chosen)].sum() == pytest.approx(best, abs=1e-6)


def test_one_state_can_be_enough_for_two_directions() -> None:
    """z = a + b stays as it is, whatever c does; without a (or b), z = b (or a) tells of c as well."""
    F = np.array([[0.0, -1.0, -1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 2.0]])
    H = np.array([[1.0, 1.0, 0.0]])
    found = frozen_observability(F, H, np.eye(3))
    assert found.rank == 1
    assert set(removable_sets(found, [LinearStretch(F, H)], np.eye(3), [False] * 3).sets) == {(0,), (1,)}


def test_a_search_that_was_cut_says_so_and_has_the_set_to_delete(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(removable, "MOST_ROWS", 5 * 7)
    F, H, P = np.zeros((8, 8)), np.ones((1, 8)), np.diag(np.arange(1.0, 9.0))
    found, stretches = frozen_observability(F, H, P), [LinearStretch(F, H)]
    sets = removable_sets(found, stretches, P, [False] * 8)
    assert not sets.complete and sets.tried == 5
    assert sets.sets[0] == least_determined_removable(found, stretches, P, [False] * 8) == (0, 1, 2, 3, 4, 5, 6)


def test_an_observable_system_has_nothing_to_remove() -> None:
    F, H = np.zeros((1, 1)), np.ones((1, 1))
    sets = removable_sets(frozen_observability(F, H, np.eye(1)), [LinearStretch(F, H)], np.eye(1), [False])
    assert sets.sets == () and sets.complete and sets.tried == 0


def test_what_only_decays_by_itself_is_undriven() -> None:
    F = np.array([[-0.1, 0.0], [1.0, 0.0]])
    assert undriven([LinearStretch(F, np.zeros((0, 2)))]).tolist() == [True, False]
