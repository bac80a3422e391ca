"""Staged estimation: small filters one after the other, and what their sigmas are worth on the whole model.

The system is a local-level INS: constants first, by velocity, then random drifts with the constants held. Against it stand
recursions written down here with textbook gains, one for the smaller filters and one for the errors of the whole model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.run.load import load_record
from estimfw.run.run import Collected, run_problem
from estimfw.run.session import Session
from tests.local_level_ins import ARCMIN, config, matrices

FloatArray = NDArray[np.float64]
Composed = Callable[[str], Problem]

COMMON = "tilt, azimuth, velocity, latitude"
HOUR, MANY = 360, 432  # steps
FIRST, SECOND = list(range(11)), [*range(6), 11, 12, 13]


def stages(first: str, until: str = "1 h", kernel: str = "numpy") -> str:
    """Constants by ``first``, then drifts by all."""
    return (
        f"{{kind: kalman, kernel: {kernel}, discretisation: {{evaluation: start}}, stages: ["
        f"{{name: constants, until: {until}, estimate: [{COMMON}, gyro_bias, accel_bias], measurements: {first}}}, "
        f"{{name: drifts, estimate: [{COMMON}, gyro_drift]}}]}}"
    )


@dataclass
class Step:
    """Phi and Q of ten seconds over chosen states of the whole model, and what the others drive them by."""

    Phi: FloatArray
    Q: FloatArray
    drive: FloatArray

    @classmethod
    def of(cls, live: list[int]) -> Step:
        F, D, _ = matrices("full14")
        gone = [i for i in range(14) if i not in live]
        kept = F.copy()
        kept[gone] = 0.0
        n = 14
        block = np.zeros((2 * n, 2 * n))
        diffusion = D.copy()
        diffusion[gone], diffusion[:, gone] = 0.0, 0.0
        block[:n, :n], block[:n, n:], block[n:, n:] = -kept, diffusion, kept.T
        whole = expm(block * 10.0)
        Phi = whole[n:, n:].T
        Q = Phi @ whole[:n, n:]
        return cls(Phi[np.ix_(live, live)], Q[np.ix_(live, live)], Phi[np.ix_(live, gone)])


def observed(heading: bool) -> tuple[FloatArray, FloatArray]:
    """H (rows, 14) and R."""
    H = np.zeros((3, 14))
    H[0, 3] = H[1, 4] = H[2, 2] = 1.0
    rows = [0, 1, 2] if heading else [0, 1]
    return H[rows], np.diag([0.05**2, 0.05**2, (6.0 * ARCMIN) ** 2])[np.ix_(rows, rows)]


def small_filters(z: FloatArray, heading_first: bool, many: int) -> tuple[FloatArray, FloatArray]:
    """Estimates (steps, 14) and covariances (steps, 14, 14) of const11 for an hour, then gm9 with its six common states."""
    x, P = np.zeros(14), np.diag(matrices("full14")[2] ** 2)
    estimates, covariances = [], []
    for k in range(many):
        live, heading = (FIRST, heading_first) if k < HOUR else (SECOND, True)
        if k in (0, HOUR):
            step, own = Step.of(live), np.zeros((14, 14))
            own[:6, :6], own[11:, 11:] = P[:6, :6], np.diag(matrices("full14")[2][11:] ** 2)
            P = P if k == 0 else own
        gone = [i for i in range(14) if i not in live]
        H, R = observed(heading)
        h = H[:, live]
        a = step.Phi @ x[live] + step.drive @ x[gone]
        p = step.Phi @ P[np.ix_(live, live)] @ step.Phi.T + step.Q
        K = p @ h.T @ np.linalg.inv(h @ p @ h.T + R)
        x[live], P = a + K @ (z[k, : len(h)] - h @ a), np.zeros((14, 14))
        P[np.ix_(live, live)] = p - K @ h @ p
        estimates.append(x.copy())
        covariances.append(P)
    return np.array(estimates), np.array(covariances)


def true_sigma(heading_first: bool, many: int) -> FloatArray:
    """Sigmas (steps, 14) of the errors that the gains of these filters have on the whole model."""
    sigma = matrices("full14")[2]
    whole = Step.of(list(range(14)))
    truth, own = np.diag(sigma**2), np.diag(sigma**2)
    joint, found = truth.copy(), []
    for k in range(many):
        live, heading = (FIRST, heading_first) if k < HOUR else (SECOND, True)
        if k in (0, HOUR):
            step, mine = Step.of(live), np.zeros((14, 14))
            mine[:6, :6], mine[11:, 11:] = own[:6, :6], np.diag(sigma[11:] ** 2)
            own = own if k == 0 else mine
        H, R = observed(heading)
        p = step.Phi @ own[np.ix_(live, live)] @ step.Phi.T + step.Q
        h = H[:, live]
        K = np.zeros((14, len(h)))
        K[live] = p @ h.T @ np.linalg.inv(h @ p @ h.T + R)
        own = np.zeros((14, 14))
        own[np.ix_(live, live)] = p - K[live] @ h @ p
        # The error of a held state that drifts: e' = e + (Phi - 1) x, with x itself beside it.
        moved = np.eye(28)
        moved[:14, :14], extra = whole.Phi, np.eye(14)
        held = [i for i in range(14) if i not in live]
        filters = whole.Phi.copy()
        filters[held] = extra[held]
        filters[np.ix_(live, held)] = step.drive
        filters[np.ix_(live, live)] = step.Phi
        moved[14:, 14:], moved[14:, :14] = filters, whole.Phi - filters
        if k == 0:
            joint = np.block([[truth, truth], [truth, truth]])
        noise = np.block([[whole.Q, whole.Q], [whole.Q, whole.Q]])
        joint = moved @ joint @ moved.T + noise
        A = np.eye(28)
        A[14:, 14:] -= K @ H
        joint = A @ joint @ A.T
        joint[14:, 14:] += K @ R @ K.T
        found.append(np.sqrt(np.diag(joint)[14:]))
    return np.array(found)


@pytest.fixture(scope="module")
def run(composed: Composed) -> Callable[..., Collected]:
    return lambda first, kernel="numpy", hours=1.2: run_problem(
        composed(config("full14", duration=3600.0 * hours, estimator=stages(first, kernel=kernel)))
    )


@pytest.mark.parametrize(("first", "heading"), [("[velocity_fix]", False), ("[velocity_fix, heading]", True)])
def test_stages_are_the_small_filters_one_after_the_other(
    run: Callable[..., Collected], first: str, heading: bool
) -> None:
    done = run(first)
    record = done.prepared.record.streams
    z = np.hstack([record["velocity_fix"].values, record["heading"].values])
    estimates, covariances = small_filters(z, heading, MANY)
    sigma = np.sqrt(np.einsum("kii->ki", covariances))
    np.testing.assert_allclose(done.sigma, sigma, rtol=1e-8, atol=1e-300)
    scale = np.where(sigma > 0.0, sigma, matrices("full14")[2])
    assert np.max(np.abs(done.estimate - estimates) / scale) < 1e-6
    assert np.all(done.sigma[:HOUR, 11:] == 0.0) and np.all(done.sigma[HOUR:, 6:11] == 0.0)
    assert np.all(done.estimate[HOUR:, 6:11] == done.estimate[HOUR - 1, 6:11])


def test_the_first_stage_is_a_filter_without_the_held_states(composed: Composed) -> None:
    """The same record, and a config that has no random drifts at all."""
    staged = composed(config("full14", duration=4320.0, estimator=stages("[velocity_fix]")))
    record = load_record(staged)
    alone = composed(config("const11", measured=("velocity_fix",), estimator="{kind: kalman, kernel: numpy}"))
    one, two = (run_problem(problem, record=record) for problem in (staged, alone))
    np.testing.assert_allclose(one.sigma[:HOUR, :11], two.sigma[:HOUR], rtol=1e-9)
    assert np.max(np.abs(one.estimate[:HOUR, :11] - two.estimate[:HOUR]) / two.sigma[:HOUR]) < 1e-6


@pytest.mark.parametrize(("first", "heading"), [("[velocity_fix]", False), ("[velocity_fix, heading]", True)])
def test_honest_sigma_goes_through_all_stages(run: Callable[..., Collected], first: str, heading: bool) -> None:
    done = run(first)
    assert done.honest is not None
    np.testing.assert_allclose(done.honest.sigma, true_sigma(heading, MANY), rtol=1e-6)


def test_after_an_hour_of_constants_and_three_of_drifts_the_claims_are_far_too_small(
    run: Callable[..., Collected],
) -> None:
    """Tilt by what is left of the accelerometer biases, 98.5 ug = 0.339' over 0.0277'; azimuth and vertical drift by the drift
    that the first stage took for a constant."""
    done = run("[velocity_fix]", "numba", 4.0)
    assert done.honest is not None
    ratio = done.honest.sigma[-1][SECOND] / done.sigma[-1][SECOND]
    assert done.sigma[-1, 0] / ARCMIN == pytest.approx(0.0277, abs=5e-5)
    assert ratio[:2] == pytest.approx([12.3, 12.3], abs=0.05)
    assert ratio[2] == pytest.approx(4.62, abs=0.01)
    assert ratio[8] == pytest.approx(3.84, abs=0.01)


@pytest.mark.parametrize("more", ["", ", covariance: joseph"])
def test_both_kernels_and_both_forms_agree(composed: Composed, more: str) -> None:
    both = []
    for kernel in ("numpy", "numba"):
        text = stages("[velocity_fix]", kernel=kernel).replace("kind: kalman", f"kind: kalman{more}")
        both.append(run_problem(composed(config("full14", duration=4000.0, estimator=text))))
    np.testing.assert_allclose(both[0].sigma, both[1].sigma, rtol=1e-8, atol=1e-300)
    assert both[0].honest is not None and both[1].honest is not None
    np.testing.assert_allclose(both[0].honest.sigma, both[1].honest.sigma, rtol=1e-7)


def test_a_session_goes_through_the_same_stages(composed: Composed) -> None:
    problem = composed(config("full14", duration=400.0, estimator=stages("[velocity_fix]", "195 s")))
    done = run_problem(problem)
    streams, session = done.prepared.record.streams, Session(problem)
    for k, time in enumerate(streams["velocity_fix"].time):
        for name in streams:
            session.measure(name, float(time), streams[name].values[k])
        told = session.advance(float(time))
    assert [round(float(t), 6) for t in done.prepared.steps.time[18:22]] == [190.0, 195.0, 200.0, 210.0]
    assert [value for value, _ in told.states.values()] == done.estimate[-1].tolist()
    assert [sigma for _, sigma in told.states.values()] == done.sigma[-1].tolist()
    assert session.counts["heading"]["fused"] == 21


def test_a_drift_that_is_held_keeps_its_value_and_comes_back_with_the_sigma_that_it_had(composed: Composed) -> None:
    text = (
        "{kind: kalman, stages: [{name: all, until: 1000 s}, "
        f"{{name: without, until: 2000 s, estimate: [{COMMON}, gyro_bias, accel_bias]}}, {{name: again}}]}}"
    )
    done = run_problem(composed(config("full14", duration=3000.0, estimator=text)))
    before, held, again = 99, slice(100, 200), 200
    assert np.all(done.estimate[held, 11:] == done.estimate[before, 11:]) and np.any(done.estimate[before, 11:])
    assert np.all(done.sigma[held, 11:] == 0.0)
    decay = np.exp(-10.0 / 3600.0)
    grown = np.sqrt(decay**2 * done.sigma[before, 11:] ** 2 + (1.0 - decay**2) * matrices("full14")[2][11:] ** 2)
    assert done.sigma[again, 11:] == pytest.approx(grown, rel=2e-3)


def test_in_a_closed_loop_a_stage_is_the_filter_of_fewer_states(example: Callable[..., Problem]) -> None:
    """On an IMU: sensor errors are held for the first 20 s, as in a model that never had them."""
    words = ("policies=[]", "source.duration=40 s")
    staged = "[{name: a, until: 20 s, estimate: [velocity_error, attitude_error]}, {name: b}]"
    staged = f"estimator={{kind: kalman, loop: closed, stages: {staged}}}"
    fewer = ("policies=[{kind: drop_states, states: [accel_bias, gyro_bias]}]", words[1])
    one = run_problem(example("static_12", *words, staged))
    two = run_problem(example("static_12", *fewer, "estimator={kind: kalman, loop: closed}"))
    np.testing.assert_allclose(one.sigma[:20, :6], two.sigma[:20], rtol=1e-9)
    np.testing.assert_allclose(one.estimate[:20, :6], two.estimate[:20], rtol=1e-6, atol=1e-12)
    assert np.all(one.sigma[:20, 6:] == 0.0) and np.all(one.sigma[20:, 6:] > 0.0)


def considering(kernel: str, covariance: str = "ud") -> str:
    """Constants first; then drifts, with what is left of the constants taken into account."""
    return (
        stages("[velocity_fix]", kernel=kernel)
        .replace("kind: kalman", f"kind: kalman, covariance: {covariance}")
        .replace(
            f"estimate: [{COMMON}, gyro_drift]", f"estimate: [{COMMON}, gyro_drift], consider: [gyro_bias, accel_bias]"
        )
        .replace(
            f"estimate: [{COMMON}, gyro_bias, accel_bias]",
            f"estimate: [{COMMON}, gyro_bias, accel_bias], consider: [gyro_drift]",
        )
    )


@pytest.mark.parametrize("covariance", ["ud", "joseph"])
def test_a_filter_that_considers_what_it_does_not_estimate_claims_what_is_true(
    composed: Composed, covariance: str
) -> None:
    both = []
    for kernel in ("numpy", "numba"):
        text = config("full14", duration=4320.0, estimator=considering(kernel, covariance))
        both.append(run_problem(composed(text)))
    numpy, numba = both
    assert numpy.honest is not None
    np.testing.assert_allclose(numpy.honest.sigma, numpy.sigma, rtol=1e-6)
    np.testing.assert_allclose(numba.sigma, numpy.sigma, rtol=1e-8)
    assert np.max(np.abs(numba.estimate - numpy.estimate) / numpy.sigma) < 1e-6
    assert np.all(numpy.estimate[:HOUR, 11:] == 0.0) and np.all(np.ptp(numpy.estimate[HOUR:, 6:11], axis=0) == 0.0)
    assert np.all(np.diff(numpy.sigma[HOUR:, 6:11], axis=0) == pytest.approx(0.0, abs=1e-12))
    alone = run_problem(composed(config("full14", duration=4320.0, measured=("velocity_fix", "heading"))))
    assert np.all(numpy.sigma[-1] >= alone.sigma[-1] * (1.0 - 1e-9))


FAULTS = {
    "unknown block": ("[{name: a, until: 1 h, estimate: [tlit]}, {name: b}]", "tlit", "did you mean 'tilt'"),
    "unknown measurement": ("[{name: a, measurements: [headin]}]", "headin", "did you mean 'heading'"),
    "not ascending": ("[{name: a, until: 2 h}, {name: b, until: 1 h}, {name: c}]", "not after 7200 s", "follow each other"),
    "no end": ("[{name: a}, {name: b}]", "does not say when it ends", "follow each other"),
    "an end of the last": ("[{name: a, until: 1 h}]", "is the last one", "leave its `until` out"),
    "both": ("[{name: a, estimate: [tilt], consider: ['tilt[x]']}]", "both estimated and considered", "once"),
    "nothing": ("[{name: a, estimate: []}]", "nothing is estimated", "name a block"),
}  # fmt: skip


@pytest.mark.parametrize("case", FAULTS)
def test_slips_are_told_with_their_place(composed: Composed, case: str) -> None:
    text, message, hint = FAULTS[case]
    with pytest.raises(ConfigError, match=r"stage|estimate|consider|measurement") as caught:
        composed(config("full14", estimator=f"{{kind: kalman, stages: {text}}}"))
    assert message in str(caught.value) and hint in str(caught.value) and caught.value.location is not None


@pytest.mark.parametrize(
    ("until", "told"),
    [("5 h", "stage 'drifts' has no steps: the run goes from 0 to 14400 s"), ("4 h", "'drifts' has no steps")],
)
def test_a_stage_outside_of_the_record_is_refused(composed: Composed, until: str, told: str) -> None:
    problem = composed(config("full14", estimator=stages("[velocity_fix]", until)))
    with pytest.raises(ConfigError, match="has no steps") as caught:
        run_problem(problem)
    assert told in str(caught.value) and caught.value.location is not None


def test_what_would_go_back_to_the_prior_is_refused_beside_stages(composed: Composed) -> None:
    text = config("full14", estimator=stages("[velocity_fix]"))
    with pytest.raises(ConfigError, match="smoother follows one model"):
        composed(text.replace("stages:", "smoother: {kind: fixed_interval}, stages:"))
    gated = text.replace("stages:", "gate: 0.999, stages:") + "health: {rejected: {then: inflate}}\n"
    with pytest.raises(ConfigError, match="give a held state its prior back"):
        composed(gated)


def test_a_filter_with_stages_does_not_restart_and_is_no_member_of_a_bank(composed: Composed) -> None:
    with pytest.raises(ConfigError, match="does not restart"):
        composed(config("full14", estimator=stages("[velocity_fix]").replace("stages:", "restarts: [10 s], stages:")))
    with pytest.raises(ConfigError, match="bank has no stages"):
        composed(config("full14", estimator=f"{{kind: bank, filter: {stages('[velocity_fix]')}}}"))
