"""What the choice of a formula for Q does to a whole filter, and the word that is said where Q is no covariance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.estimators.scan import SubSteps
from estimfw.run.dataset import result_dataset
from estimfw.run.discretisation import study_filter
from estimfw.run.indefinite_noise import INDEFINITE_NOISE, indefinite_noise
from estimfw.run.load import load_record
from estimfw.run.plausibility import cautions
from estimfw.run.prepare import prepare
from estimfw.run.run import run_problem
from estimfw.run.session import Session
from tests.local_level_ins import config

Composed = Callable[[str], Problem]


def ins(composed: Composed, discretisation: str, duration: float = 600.0) -> Problem:
    estimator = f"{{kind: kalman, discretisation: {discretisation}}}"
    return composed(config("gm9", duration=duration, estimator=estimator))


def test_at_ten_seconds_the_choice_changes_no_sigma_of_the_filter_by_1e_4(composed: Composed) -> None:
    """From the second order on; Q = D T alone, which leaves out how noise spreads within a step, costs half a per cent."""
    problem = ins(composed, "{evaluation: start}", 14400.0)
    found = {one.key: one for one in study_filter(problem, [10.0]).sigmas}
    for key in ("second", "third", "held_noise"):
        assert 0.0 < found[key].largest < 1e-4
    assert 1e-3 < found["first"].largest < 1e-2


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_held_noise_in_the_filter_is_its_definition(composed: Composed, kernel: str) -> None:
    """Against a covariance recursion written down here, with Gamma by quadrature, over steps that are sub-stepped too."""
    from scipy.linalg import expm

    text = config(
        "gm9", duration=1500.0, rate=1 / 300.0, estimator="{kind: kalman, discretisation: {method: held_noise}}"
    )
    problem = composed(text)
    problem = replace(problem, estimator=problem.estimator.model_copy(update={"kernel": kernel}))
    done = run_problem(problem)
    plan, row = problem.plan, np.zeros(0)
    F, D, P = plan.F.evaluate(row), plan.D.evaluate(row), done.prepared.prior[1]
    nodes, weights = np.polynomial.legendre.leggauss(20)
    Gamma = np.einsum("k,kij->ij", 150.0 * weights, expm(F * (150.0 * (nodes + 1.0))[:, None, None]))
    for k in range(5):
        P = expm(F * 300.0) @ P @ expm(F * 300.0).T + Gamma @ D @ Gamma.T / 300.0
        for m in plan.measurements:
            H = m.H.evaluate(row)
            P = P - P @ H.T @ np.linalg.solve(H @ P @ H.T + np.array(m.R), H @ P)
        assert done.sigma[k] == pytest.approx(np.sqrt(np.diag(P)), rel=1e-9)


def test_a_series_that_is_no_covariance_is_told_with_its_eigenvalue(composed: Composed) -> None:
    done = run_problem(ins(composed, "{method: series, phi_order: 3, q_order: 2}"))
    event = next(e for e in done.events if e.kind == INDEFINITE_NOISE)
    assert "order 2" in event.text and "-0.495" in event.text and "10 s" in event.text and "van_loan" in event.text
    assert event.text in cautions(result_dataset(done))


def test_a_session_tells_it_when_it_first_makes_such_a_step(composed: Composed) -> None:
    session = Session(ins(composed, "{method: series, phi_order: 3, q_order: 2}"))
    for time in (10.0, 20.0, 25.0):
        session.advance(time)
    told = [e.text for e in session.events if e.kind == INDEFINITE_NOISE]
    assert len(told) == 2 and "10 s" in told[0] and "5 s" in told[1]


@pytest.mark.parametrize(
    "made",
    [
        "{method: series, phi_order: 2, q_order: 1}",
        "{method: series, phi_order: 3, q_order: 3}",
        "{method: van_loan}",
        "{method: held_noise}",
    ],
)
def test_nothing_is_said_of_a_covariance(composed: Composed, made: str) -> None:
    problem = ins(composed, made)
    assert not [e for e in prepare(problem, load_record(problem)).events if e.kind == INDEFINITE_NOISE]


def test_of_several_step_lengths_the_worst_is_told(composed: Composed) -> None:
    plan = ins(composed, "{method: series, phi_order: 4, q_order: 3}").plan
    row = np.zeros(0)
    steps = SubSteps(plan, row)
    assert indefinite_noise(plan, row, np.array([10.0, 60.0, 0.0]), steps) == ()
    (event,) = indefinite_noise(plan, row, np.array([10.0, 300.0, 60.0, 10.0]), steps)
    assert "300 s" in event.text and "-0.29" in event.text
