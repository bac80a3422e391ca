"""Degrees against closed forms."""

from __future__ import annotations

import numpy as np

from estimfw.analysis.degree import observable_part, posterior_over_prior


def test_posterior_over_prior_of_a_state_known_beforehand_is_not_a_number() -> None:
    found = posterior_over_prior(np.diag([1.0, 0.0]), np.diag([4.0, 0.0]))
    assert found[0] == 0.5 and np.isnan(found[1])


def test_two_constants_read_as_a_sum_are_known_but_for_their_difference() -> None:
    """z = a + b, equal priors: of each, the half that is the sum has r / sqrt(2 + r^2) left; the difference has all."""
    r = 0.1
    h = np.array([[1.0, 1.0]])
    P = np.eye(2) - h.T @ h / (2.0 + r * r)
    unseen = np.array([[1.0], [-1.0]])
    wanted = r / np.sqrt(2.0 + r * r)
    assert np.allclose(observable_part(P, unseen, np.eye(2)), wanted)
    assert np.all(posterior_over_prior(P, np.eye(2)) > 0.7)


def test_the_length_of_the_directions_and_the_units_of_states_play_no_part() -> None:
    rng = np.random.default_rng(1)
    a = rng.standard_normal((4, 4))
    P, N, units = a @ a.T, rng.standard_normal((4, 2)), np.diag([1.0, 1e-6, 1e3, 1e-9])
    plain = observable_part(P, N, np.eye(4))
    assert np.allclose(observable_part(units @ P @ units, units @ N * [1e8, 1e-8], units), plain)


def test_without_unobservable_directions_it_is_the_degree_itself() -> None:
    rng = np.random.default_rng(2)
    a = rng.standard_normal((3, 3))
    P, prior = a @ a.T, np.diag([4.0, 9.0, 0.25])
    found = observable_part(P, np.zeros((3, 0)), np.sqrt(prior))
    assert np.allclose(found, posterior_over_prior(P, prior))


def test_a_state_of_which_nothing_is_observable_has_no_part() -> None:
    found = observable_part(np.eye(2), np.array([[1.0], [0.0]]), np.eye(2))
    assert np.isnan(found[0]) and found[1] == 1.0
