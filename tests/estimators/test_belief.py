"""What becomes of a covariance when a stage begins: three states with correlations, by hand."""

from __future__ import annotations

import numpy as np

from estimfw.estimators.belief import Belief

PRIOR = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 2.0], [0.0, 2.0, 16.0]])
LATER = np.array([[2.0, 0.5, 0.3], [0.5, 5.0, 0.7], [0.3, 0.7, 8.0]])


def held(*states: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.isin(np.arange(3), states)


def test_at_the_start_what_is_estimated_has_its_prior_and_what_is_held_has_none() -> None:
    begun = Belief.before_all(PRIOR).changed(held(1))
    assert begun.covariance.tolist() == [[4.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 16.0]]
    whole = Belief.before_all(PRIOR).changed(held())
    assert np.array_equal(whole.covariance, PRIOR)


def test_what_was_never_estimated_enters_with_its_prior_apart_from_the_others() -> None:
    begun = Belief.before_all(PRIOR).changed(held(1, 2))
    covariance = np.diag([3.0, 0.0, 0.0])
    entered = Belief(covariance, begun.kept, begun.held).changed(held())
    assert entered.covariance.tolist() == [[3.0, 0.0, 0.0], [0.0, 9.0, 2.0], [0.0, 2.0, 16.0]]


def test_what_was_held_enters_again_with_what_it_had_and_with_what_left_with_it() -> None:
    begun = Belief.before_all(PRIOR).changed(held())
    apart = Belief(LATER, begun.kept, begun.held).changed(held(1, 2))
    assert apart.covariance.tolist() == [[2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    again = apart.changed(held())
    assert again.covariance.tolist() == [[2.0, 0.0, 0.0], [0.0, 5.0, 0.7], [0.0, 0.7, 8.0]]


def test_states_that_left_at_different_times_come_back_uncorrelated() -> None:
    first = Belief(LATER, PRIOR, held()).changed(held(2))
    second = first.changed(held(1, 2))
    assert second.changed(held()).covariance.tolist() == [[2.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 8.0]]


def test_nothing_changes_where_the_same_states_go_on() -> None:
    belief = Belief(np.diag([1.0, 0.0, 2.0]), PRIOR, held(1))
    same = belief.changed(held(1))
    assert np.array_equal(same.covariance, belief.covariance) and np.array_equal(same.kept, belief.kept)
