"""What suboptimal decentralised forms cost: the published prices of gravimeter alignment, and errors that were drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.analysis.suboptimal import LinearStep, priced
from estimfw.errors import ConfigError
from estimfw.kernels.discretise import van_loan
from estimfw.plan.separation import Form

FloatArray = NDArray[np.float64]

STATES = ["dVx", "dVy", "phi_x", "phi_y", "phi_z", "dA_x", "dA_y", "eps_x", "eps_y", "eps_z"]
DEG = np.pi / 180.0


def alignment(alpha: float) -> tuple[LinearStep, FloatArray]:
    """A step of 1 s of a levelled platform at 39.1 deg that is turned by alpha, and the prior."""
    rate, gravity, radius = 7.292115e-5, 9.80665, 6371000.0
    up, north, tan = rate * np.sin(39.1 * DEG), rate * np.cos(39.1 * DEG), np.tan(39.1 * DEG)
    c, s = np.cos(alpha), np.sin(alpha)
    F = np.zeros((10, 10))
    F[0, [1, 3, 5, 6]] = 2.0 * up, -gravity, c, -s
    F[1, [0, 2, 5, 6]] = -2.0 * up, gravity, s, c
    F[2, [1, 3, 4, 7, 8]] = -1.0 / radius, up, -north, c, -s
    F[3, [0, 2, 7, 8]] = 1.0 / radius, -up, s, c
    F[4, [0, 2, 9]] = tan / radius, north, 1.0
    noise = np.array([5e-6 * gravity] * 2 + [0.001 * DEG / 60.0] * 3 + [0.0] * 5) ** 2
    sigma = np.array([0.1, 0.1, 0.1 * DEG, 0.1 * DEG, DEG, *[50e-6 * gravity] * 2, *[0.02 * DEG / 3600.0] * 3])
    Phi, Q, d = van_loan(F, np.diag(noise), np.zeros(10), np.array(1.0), 0)
    return LinearStep(Phi, Q, d, np.eye(10)[:2], 1e-4 * np.eye(2)), np.diag(sigma**2)


def groups(text: str) -> list[list[int]]:
    return [[STATES.index(state) for state in group.split()] for group in text.split("/")]


AXES = "dVx phi_y dA_x eps_y eps_z / dVy phi_x phi_z dA_y eps_x"
BY_CORRELATION = {
    30: "dVx phi_x phi_y dA_x dA_y / dVy phi_z eps_x eps_y eps_z",
    0: "dVx phi_x dA_y eps_y eps_z / dVy phi_y phi_z dA_x eps_x",
}


@pytest.mark.parametrize(
    ("form", "alpha", "split", "price"),
    [
        ("drop", 30, BY_CORRELATION[30], "59"),
        ("drop", 0, BY_CORRELATION[0], "38"),
        ("drop", 30, AXES, "1.15"),
        ("drop", 0, AXES, "1.02"),
        ("decoupled", 30, BY_CORRELATION[30], "2.37e+04"),
        ("decoupled", 0, BY_CORRELATION[0], "1.05e+05"),
        ("decoupled", 30, AXES, "4.3"),
        ("decoupled", 0, AXES, "19"),
    ],
)
def test_prices_after_1200_steps_are_the_published_ones(form: Form, alpha: int, split: str, price: str) -> None:
    step, prior = alignment(alpha * DEG)
    found = priced(form, groups(split), [step] * 1200, np.zeros(10), prior)
    digits = len(price.split("e")[0].replace(".", ""))
    assert f"{found.ratio[-1].max():.{digits}g}" == price


def random_steps(rng: np.random.Generator, rows: int, steps: int) -> list[LinearStep]:
    made = []
    for _ in range(steps):
        A, B = rng.standard_normal((5, 5)), rng.standard_normal((rows, rows))
        Phi, d = 0.6 * np.eye(5) + 0.2 * rng.standard_normal((5, 5)), rng.standard_normal(5)
        made.append(
            LinearStep(Phi, 0.1 * A @ A.T, d, rng.standard_normal((rows, 5)), B @ B.T + np.eye(rows), (0, 1, 2))
        )
    return made


def drawn_errors(
    form: Form, of: Sequence[int], owners: Sequence[int], steps: list[LinearStep], mean: FloatArray, P: FloatArray
) -> FloatArray:
    """Root mean squares (K, n) of the errors of 40000 filters, each with its own truth and its own readings."""
    rng, n = np.random.default_rng(5), len(mean)
    state, row = np.array(of), np.array(owners)
    inside, corrects = state[:, None] == state, state[:, None] == row
    x = mean + rng.standard_normal((40_000, n)) @ np.linalg.cholesky(P).T
    estimate, own, kept = np.broadcast_to(mean, x.shape), np.where(inside, P, 0.0), []
    for step in steps:
        alone = form == "decoupled"
        Phi, H = np.where(inside | (not alone), step.Phi, 0.0), np.where(corrects.T | (not alone), step.H, 0.0)
        x = x @ step.Phi.T + step.d + rng.standard_normal(x.shape) @ np.linalg.cholesky(step.Q).T
        y = x @ step.H.T + rng.standard_normal((len(x), len(row))) @ np.linalg.cholesky(step.R).T
        estimate = estimate @ Phi.T + step.d
        own = np.where(inside, Phi @ own @ Phi.T + step.Q, 0.0)
        new, before = own.copy(), estimate
        for group in sorted(set(of)):
            i, j = state == group, row == group
            S = H[j] @ own @ H[j].T + step.R[np.ix_(j, j)]
            K = own[np.ix_(i, i)] @ H[np.ix_(j, i)].T @ np.linalg.inv(S)
            estimate = estimate.copy()
            estimate[:, i] += (y - before @ H.T)[:, j] @ K.T
            new[np.ix_(i, i)] -= K @ S @ K.T
        own = new
        kept.append(np.sqrt(np.mean((x - estimate) ** 2, axis=0)))
    return np.array(kept)


@pytest.mark.parametrize("form", ["drop", "decoupled"])
def test_true_sigma_is_the_scatter_of_errors_that_were_drawn(form: Form) -> None:
    rng = np.random.default_rng(3)
    steps, mean, owners = random_steps(rng, 3, 8), rng.standard_normal(5), (0, 1, 1)
    A = rng.standard_normal((5, 5))
    P = A @ A.T + np.eye(5)
    found = priced(form, [[0, 2], [1, 3, 4]], steps, mean, P, owners)
    drawn = drawn_errors(form, (0, 1, 0, 1, 1), owners, steps, mean, P)
    assert np.abs(found.true / drawn - 1.0).max() < 0.02  # 40000 draws scatter by 0.35 % (one sigma)
    assert np.all(found.true >= found.optimal)
    assert found.ratio.max() > 1.05  # the form does cost something here


def test_one_group_costs_nothing() -> None:
    rng = np.random.default_rng(8)
    steps, P = random_steps(rng, 3, 10), np.eye(5)
    found = priced("decoupled", [range(5)], steps, np.ones(5), P)
    assert np.allclose(found.true, found.optimal, rtol=1e-9)
    assert np.allclose(found.own, found.optimal, rtol=1e-9)


def test_groups_that_leave_a_state_out_or_rows_without_one_owner_are_refused() -> None:
    step, prior = alignment(0.0)
    with pytest.raises(ConfigError, match="state 9 is in no group"):
        priced("drop", [range(5), range(5, 9)], [step], np.zeros(10), prior)
    with pytest.raises(ConfigError, match="state 0 is in 2 groups"):
        priced("drop", [range(10), [0]], [step], np.zeros(10), prior)
    both = LinearStep(step.Phi, step.Q, step.d, step.H[:1] + step.H[1:], step.R[:1, :1])
    with pytest.raises(ConfigError, match="row 0 of the measurements reads states of several groups"):
        priced("drop", groups(AXES), [both], np.zeros(10), prior)
