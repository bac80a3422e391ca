"""The prior: rotated with a frame change, a marginal after a deletion, refused where it is no covariance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from estimfw.errors import ConfigError
from estimfw.model.coefficient import constant, identity, matrix
from estimfw.model.prior import Prior, check_covariance

C = Rotation.from_euler("ZXY", [40.0, 20.0, -30.0], degrees=True).as_matrix()
RNG = np.random.default_rng(3)
ROOT = RNG.normal(size=(6, 6))
FULL = ROOT @ ROOT.T
MEAN = RNG.normal(size=6)


def prior_of(mean: np.ndarray, covariance: np.ndarray) -> Prior:
    n = len(mean)
    return Prior(tuple(float(x) for x in mean), tuple(tuple(float(x) for x in row) for row in covariance), identity(n))


def test_a_full_prior_turns_with_its_triad() -> None:
    mean, covariance = prior_of(MEAN, FULL).rotate([3, 4, 5], matrix("C_bn")).evaluate({"C_bn": C})
    T = np.eye(6)
    T[3:, 3:] = C
    assert np.allclose(covariance, T @ FULL @ T.T, atol=1e-13)
    assert np.allclose(mean, T @ MEAN, atol=1e-13)


def test_a_deletion_takes_the_marginal_also_after_a_turn() -> None:
    """The marginal of a Gaussian: rows and columns of its covariance."""
    turned = prior_of(MEAN, FULL).rotate([3, 4, 5], matrix("C_bn"))
    kept = [0, 2, 3, 5]
    mean, covariance = turned.select(kept).evaluate({"C_bn": C})
    whole_mean, whole = turned.evaluate({"C_bn": C})
    assert np.allclose(covariance, whole[np.ix_(kept, kept)], atol=1e-14)
    assert np.allclose(mean, whole_mean[kept], atol=1e-14)


def test_the_marginal_agrees_with_samples() -> None:
    """Against drawing: rotate and drop the draws, and take their covariance."""
    draws = MEAN + np.random.default_rng(0).standard_normal((400_000, 6)) @ ROOT.T
    draws[:, 3:] = draws[:, 3:] @ C.T
    kept = [1, 4, 5]
    _, covariance = prior_of(MEAN, FULL).rotate([3, 4, 5], matrix("C_bn")).select(kept).evaluate({"C_bn": C})
    sampled = np.cov(draws[:, kept].T)
    sigma = np.sqrt(np.diag(covariance))
    assert np.all(np.abs(sampled - covariance) < 5.0 * np.sqrt(2.0 / 400_000) * np.outer(sigma, sigma))


def test_an_isotropic_triad_does_not_need_the_attitude() -> None:
    covariance = np.diag([1.0, 2.0, 3.0, 4.0, 4.0, 4.0])
    prior = prior_of(np.zeros(6), covariance)
    turned = prior.rotate([3, 4, 5], matrix("C_bn"))
    assert turned.transform.is_constant
    assert np.array_equal(turned.evaluate({})[1], covariance)


@pytest.mark.parametrize("what", ["mean", "correlation", "sigma"])
def test_a_triad_that_has_a_direction_does(what: str) -> None:
    covariance, mean = np.eye(6), np.zeros(6)
    if what == "mean":
        mean[4] = 0.1
    elif what == "correlation":
        covariance[0, 4] = covariance[4, 0] = 0.1
    else:
        covariance[5, 5] = 2.0
    turned = prior_of(mean, covariance).rotate([3, 4, 5], matrix("C_bn"))
    assert turned.transform.needs == {"C_bn"}
    T = np.eye(6)
    T[3:, 3:] = C
    got_mean, got = turned.evaluate({"C_bn": C})
    assert np.allclose(got, T @ covariance @ T.T, atol=1e-15)
    assert np.allclose(got_mean, T @ mean, atol=1e-15)


def transformed(T: np.ndarray) -> Prior:
    return Prior((0.0,) * 6, tuple(map(tuple, np.eye(6).tolist())), constant(T))


def test_a_triad_turned_by_numbers_stays_isotropic_whatever_comes() -> None:
    T = np.eye(6)
    T[3:, 3:] = C
    prior = transformed(T)
    assert prior.rotate([3, 4, 5], matrix("C_bn")) == prior


@pytest.mark.parametrize("what", ["stretched", "sheared", "shared"])
def test_a_triad_made_otherwise_of_an_isotropic_one_is_turned(what: str) -> None:
    """The declared states are isotropic, what is made of them is not, or is correlated with others."""
    T = np.eye(6)
    if what == "stretched":
        T[5, 5] = 2.0
    elif what == "sheared":
        T[3, 4] = 0.5
    else:
        T[0, 3] = 1.0
    turned = transformed(T).rotate([3, 4, 5], matrix("C_bn"))
    whole = np.eye(6)
    whole[3:, 3:] = C
    expected = whole @ T @ T.T @ whole.T
    assert np.allclose(turned.evaluate({"C_bn": C})[1], expected, atol=1e-14)


def test_many_attitudes_give_many_priors() -> None:
    many = Rotation.random(7, rng=np.random.default_rng(1)).as_matrix()
    turned = prior_of(MEAN, FULL).rotate([3, 4, 5], matrix("C_bn"))
    means, covariances = turned.evaluate({"C_bn": many})
    for k in range(7):
        mean, covariance = turned.evaluate({"C_bn": many[k]})
        assert np.allclose(covariances[k], covariance, atol=1e-14)
        assert np.allclose(means[k], mean, atol=1e-14)


LABELS = ["a", "b", "c"]


def test_a_matrix_that_is_no_covariance_is_refused_with_its_worst_eigenvalue() -> None:
    bad = np.array([[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]])
    worst = np.linalg.eigvalsh(bad)[0]
    with pytest.raises(ConfigError, match=rf"not positive semidefinite: worst eigenvalue {worst:.3g}"):
        check_covariance(bad * np.outer([1e-6, 1.0, 1e3], [1e-6, 1.0, 1e3]), LABELS)


def test_an_asymmetric_one_names_the_states() -> None:
    bad = np.eye(3)
    bad[0, 2] = 0.5
    with pytest.raises(ConfigError, match=r"not symmetric: a and c differ by 0\.5"):
        check_covariance(bad, LABELS)


def test_a_singular_covariance_is_a_covariance() -> None:
    check_covariance(np.ones((3, 3)), LABELS)
    check_covariance(np.zeros((3, 3)), LABELS)


def test_an_infinite_one_is_refused() -> None:
    with pytest.raises(ConfigError, match="not finite"):
        check_covariance(np.diag([1.0, np.inf, 1.0]), LABELS)
