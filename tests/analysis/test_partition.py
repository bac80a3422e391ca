"""The exact search is brute force's answer, the greedy one comes close, and what a row reads stays together."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.analysis.coupling import coupling
from estimfw.analysis.partition import best_cut, correlation, objective, seeds_of
from estimfw.analysis.partition_search import Atoms, exchanged
from estimfw.errors import ConfigError

FloatArray = NDArray[np.float64]
Groups = tuple[tuple[int, ...], ...]


def weights_of(n: int, seed: int) -> FloatArray:
    W = np.random.default_rng(seed).uniform(size=(n, n))
    return np.asarray((W + W.T) / 2.0)


def every_cut(states: list[int], sizes: list[int]) -> Iterator[Groups]:
    """All partitions into groups of these sizes: the group of the first state, then the rest."""
    if not states:
        yield ()
        return
    first, *rest = states
    for size in sorted(set(sizes), reverse=True):
        left = list(sizes)
        left.remove(size)
        for others in combinations(rest, size - 1):
            for tail in every_cut([i for i in rest if i not in others], left):
                yield ((first, *others), *tail)


def allowed(groups: Groups, seeds: Groups) -> bool:
    counts = [sum(set(s) <= set(g) for s in seeds) for g in groups]
    if sum(counts) != len(seeds):
        return False
    return max(counts) <= 1 if len(seeds) < len(groups) else min(counts) >= 1


@st.composite
def problems(draw: st.DrawFn) -> tuple[int, list[int], Groups, int]:
    sizes = draw(st.lists(st.integers(1, 3), min_size=2, max_size=3))
    n = sum(sizes)
    reads = draw(st.lists(st.lists(st.integers(0, n - 1), min_size=1, max_size=2), max_size=4))
    return n, sizes, seeds_of(reads), draw(st.integers(0, 999))


@settings(max_examples=100, deadline=None)
@given(problems())
def test_exact_search_finds_what_brute_force_finds(problem: tuple[int, list[int], Groups, int]) -> None:
    n, sizes, seeds, seed = problem
    W = weights_of(n, seed)
    cases = sorted({tuple(sorted(c)) for c in every_cut(list(range(n)), sizes) if allowed(c, seeds)})
    if not cases:
        with pytest.raises(ConfigError, match="do not fit"):
            best_cut(W, sizes, seeds)
        return
    ranked = sorted((objective(W, c) for c in cases), reverse=True)
    found = best_cut(W, sizes, seeds)
    assert found.cases == len(cases)
    assert found.groups in cases
    assert found.objective == pytest.approx(ranked[0], abs=1e-12)
    if len(cases) > 1:
        assert found.runner_up in cases and found.runner_up != found.groups
        assert found.runner_up_objective == pytest.approx(ranked[1], abs=1e-11)
    else:
        assert found.runner_up is None and np.isnan(found.runner_up_objective)


@settings(max_examples=100, deadline=None)
@given(problems())
def test_greedy_search_gives_an_allowed_cut_that_is_never_above_the_exact_one(
    problem: tuple[int, list[int], Groups, int],
) -> None:
    n, sizes, seeds, seed = problem
    W = weights_of(n, seed)
    if not any(allowed(c, seeds) for c in every_cut(list(range(n)), sizes)):
        return
    try:
        found = best_cut(W, sizes, seeds, exact=False)
    except ConfigError:
        assert any(len(s) > 1 for s in seeds)  # bulky seeds can be packed badly; single states always fit
        return
    assert not found.exact and allowed(found.groups, seeds)
    assert sorted(map(len, found.groups)) == sorted(sizes)
    assert found.objective <= best_cut(W, sizes, seeds).objective + 1e-12


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 9999), st.integers(2, 4), st.integers(2, 4))
def test_exchanges_never_lower_the_objective_from_any_start(seed: int, groups: int, size: int) -> None:
    n = groups * size
    atoms = Atoms.of(weights_of(n, seed), ())
    start = np.random.default_rng(seed).permutation(n).reshape(groups, size).tolist()
    end = exchanged(atoms, start)
    assert atoms.value(end) >= atoms.value(start) - 1e-12
    for g, h in combinations(range(groups), 2):  # and there is no exchange left that raises it
        for a in end[g]:
            for b in end[h]:
                other = [[{a: b, b: a}.get(i, i) for i in own] for own in end]
                assert atoms.value(other) <= atoms.value(end) + 1e-9


def test_greedy_search_is_better_than_chance_and_mostly_best() -> None:
    greedy, best, chance = [], [], []
    for seed in range(30):
        W = weights_of(12, seed) ** 3
        greedy.append(best_cut(W, (6, 6), ((0,), (1,)), exact=False).objective)
        best.append(best_cut(W, (6, 6), ((0,), (1,))).objective)
        rest = np.random.default_rng(seed).permutation(np.arange(2, 12)).tolist()
        chance.append(objective(W, ([0, *rest[:5]], [1, *rest[5:]])))
    assert all(g >= c for g, c in zip(greedy, chance, strict=True))
    assert np.mean(np.isclose(greedy, best)) > 0.5 and min(np.array(greedy) / best) > 0.9


def test_hidden_groups_of_a_hundred_states_are_found() -> None:
    rng = np.random.default_rng(5)
    order = rng.permutation(100)
    W = np.full((100, 100), 0.05) * rng.uniform(size=(100, 100))
    hidden = [tuple(sorted(order[20 * k : 20 * k + 20].tolist())) for k in range(5)]
    for group in hidden:
        W[np.ix_(group, group)] = rng.uniform(0.2, 0.9, size=(20, 20))
    W = (W + W.T) / 2.0
    seeds = [(g[k],) for g in hidden for k in (0, 7)]
    found = best_cut(W, [20] * 5, seeds)
    assert not found.exact and found.groups == tuple(sorted(hidden))


def test_ties_keep_the_first_in_lexicographic_order() -> None:
    found = best_cut(np.ones((4, 4)), (2, 2), ())
    assert found.groups == ((0, 1), (2, 3)) and found.runner_up == ((0, 2), (1, 3)) and found.cases == 3


def test_rows_that_share_a_state_are_one_seed() -> None:
    assert seeds_of([[3], [0, 1], [], [1, 2], [5, 3]]) == ((0, 1, 2), (3, 5))


def test_a_state_without_variance_is_correlated_with_nothing() -> None:
    rho = correlation(np.array([[4.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 1.0]]))
    np.testing.assert_array_equal(rho, [[1.0, 0.0, 0.5], [0.0, 0.0, 0.0], [0.5, 0.0, 1.0]])


def test_coupling_is_the_part_of_a_sigma_that_another_state_moves() -> None:
    made = coupling(np.array([[1.0, 0.5, 0.1], [0.0, 0.9, 0.0], [0.2, 0.0, 1.0]]), np.array([2.0, 4.0, 0.0]))
    np.testing.assert_allclose(made, [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
