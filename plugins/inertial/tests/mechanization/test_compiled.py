"""The loops are the NumPy mechanization, whatever is computed; and leading axes are runs of their own."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from estimfw_inertial import compiled, mechanization
from estimfw_inertial.mechanization import OPERATIONS, ROW_SIZE, pack_params, place_at
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

PLACE = place_at(np.array(0.6), np.array(400.0))
SUBSETS = [frozenset(c) for n in range(5) for c in combinations(OPERATIONS, n)]


def any_state(rng: np.random.Generator) -> FloatArray:
    C = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    place = [rng.uniform(-1.4, 1.4), rng.uniform(-3.1, 3.1), rng.uniform(-100.0, 9000.0)]
    return np.concatenate([C.ravel(), rng.normal(0.0, 100.0, 3), place])


def any_sample(rng: np.random.Generator, per_step: int) -> FloatArray:
    pieces = [np.concatenate([rng.normal(0.0, 0.05, 3), rng.normal(0.0, 0.2, 3)]) for _ in range(per_step)]
    return np.concatenate([[rng.uniform(0.01, 0.1)], *pieces])


@pytest.mark.parametrize("computed", SUBSETS, ids=lambda c: "+".join(sorted(c)) or "nothing")
@pytest.mark.parametrize("per_step", [1, 2])
@pytest.mark.parametrize("point", [0.0, 0.5, 1.0])
def test_a_compiled_step_is_the_step_in_numpy(computed: frozenset[str], per_step: int, point: float) -> None:
    rng = np.random.default_rng(3)
    params = pack_params(per_step, computed, point, PLACE)
    for _ in range(20):
        state, sample = any_state(rng), any_sample(rng, per_step)
        new, process, end = mechanization.step(state, sample, params)
        own, row, end_row = state.copy(), np.empty(ROW_SIZE), np.empty(ROW_SIZE)
        compiled.step(own, sample, params, row, end_row)
        assert own == pytest.approx(new, rel=1e-13, abs=1e-13)
        assert row == pytest.approx(process, rel=1e-12, abs=1e-12)
        assert end_row == pytest.approx(end, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("computed", [frozenset(), frozenset(OPERATIONS)], ids=["nothing", "all"])
def test_a_compiled_correction_is_the_one_in_numpy(computed: frozenset[str]) -> None:
    rng = np.random.default_rng(4)
    params = pack_params(2, computed, 0.5, PLACE)
    for scale in (1e-9, 1e-3, 1.0):
        state, delta = any_state(rng), scale * rng.normal(size=6)
        own = state.copy()
        compiled.correct(own, delta, params)
        assert own == pytest.approx(mechanization.correct(state, delta, params), rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("per_step", [1, 2])
def test_leading_axes_are_runs_of_their_own(per_step: int) -> None:
    rng = np.random.default_rng(5)
    params = pack_params(per_step, frozenset(OPERATIONS), 0.5, PLACE)
    states = np.array([[any_state(rng) for _ in range(3)] for _ in range(2)])
    samples = np.array([any_sample(rng, per_step) for _ in range(3)])
    many = mechanization.step(states, samples, params)
    corrected = mechanization.correct(states, samples[:, 1:7], params)
    for i in np.ndindex(2, 3):
        alone = mechanization.step(states[i], samples[i[1]], params)
        for all_runs, one in zip(many, alone, strict=True):
            assert all_runs[i] == pytest.approx(one, rel=1e-14, abs=1e-14)
        assert corrected[i] == pytest.approx(mechanization.correct(states[i], samples[i[1], 1:7], params), abs=1e-14)


def test_a_step_leaves_what_it_was_given() -> None:
    rng = np.random.default_rng(6)
    state, sample = any_state(rng), any_sample(rng, 2)
    before, as_before = state.copy(), sample.copy()
    params = pack_params(2, frozenset(), 0.5, PLACE)
    mechanization.step(state, sample, params)
    mechanization.correct(state, np.ones(6), params)
    assert np.array_equal(state, before)
    assert np.array_equal(sample, as_before)
