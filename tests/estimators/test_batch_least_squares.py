"""A smoother against one dense least-squares problem over all states of all epochs at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import numpy as np
import pytest
from hypothesis import example as also
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm, qr, solve_triangular

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.kernels import fuse, joseph, smooth, ud
from estimfw.kernels.fuse import FUSED
from estimfw.run.load import load_record
from estimfw.run.run import Collected, run_problem

FloatArray = NDArray[np.float64]
Example = Callable[..., Problem]
Fix = tuple[FloatArray, FloatArray, FloatArray]


@dataclass
class System:
    """x_0 ~ N(mean, P), x_k = Phi_k x_(k-1) + d_k + w_k, w_k ~ N(0, Q_k), and for each step the z, H and R of what is fused."""

    mean: FloatArray
    P: FloatArray
    Phi: list[FloatArray]
    Q: list[FloatArray]
    d: list[FloatArray]
    fixes: list[list[Fix]]


def root(P: FloatArray) -> FloatArray:
    """A with A A' = P, also of a singular one."""
    values, vectors = np.linalg.eigh(P)
    return np.asarray(vectors * np.sqrt(np.where(values > 1e-13 * np.max(values, initial=0.0), values, 0.0)))


def batch(system: System) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means (K + 1, n), sigmas and prior sigmas of all states, by one QR of everything that is known.

    The unknowns are the standard normal numbers s that prior and noises are made of, x = m + A s, so nothing need be inverted
    that may be singular: minimise |s|^2 + |R^(-1/2) (z - H (m + A s))|^2.
    """
    n, steps = system.mean.size, len(system.Phi)
    A = np.zeros(((steps + 1) * n, (steps + 1) * n))
    A[:n, :n] = root(system.P)
    m = np.concatenate([system.mean, *system.d])
    for k, (Phi, Q) in enumerate(zip(system.Phi, system.Q, strict=True), start=1):
        own, before = slice(k * n, (k + 1) * n), slice((k - 1) * n, k * n)
        A[own] = Phi @ A[before]
        A[own, own] = root(Q)
        m[own] += Phi @ m[before]
    rows, right = [np.eye(A.shape[1])], [np.zeros(A.shape[1])]
    for k, fixes in enumerate(system.fixes, start=1):
        for z, H, R in fixes:
            W = np.linalg.inv(np.linalg.cholesky(R))
            rows.append(W @ H @ A[k * n : (k + 1) * n])
            right.append(W @ (z - H @ m[k * n : (k + 1) * n]))
    orthogonal, upper = qr(np.concatenate(rows), mode="economic")
    s = solve_triangular(upper, orthogonal.T @ np.concatenate(right))
    spread = solve_triangular(upper, A.T, trans="T")
    shape = (steps + 1, n)
    sigma = np.sqrt(np.sum(spread**2, axis=0))
    return (m + A @ s).reshape(shape), sigma.reshape(shape), np.sqrt(np.sum(A**2, axis=1)).reshape(shape)


def smoothed(system: System, kernel: ModuleType) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means, smoothed and filtered sigmas, by the kernels."""
    x, form = system.mean, kernel.factor(system.P)
    states, forms, updates = [x], [form], []
    for Phi, Q, d, fixes in zip(system.Phi, system.Q, system.d, system.fixes, strict=True):
        predicted = x = Phi @ x + d
        form = kernel.predict(form, Phi, Q)
        for z, H, R in fixes:
            done = fuse.fuse(kernel, x, form, z, H, R, None)
            x, form = done.x, done.form
        updates.append(x - predicted)
        states.append(x)
        forms.append(form)
    factored = np.array(forms) if kernel is ud else ud.factor(np.array(forms))
    C, L = smooth.gain(factored[:-1], np.array(system.Phi), np.array(system.Q))
    b = np.einsum("kij,kj->ki", C, np.array(updates))
    u, P = smooth.backward(C, b, L, np.zeros(x.size), factored[-1])
    return np.array(states) + u, *(np.sqrt(np.einsum("kii->ki", ud.covariance(f))) for f in (P, factored))


def random_system(seed: int, n: int, steps: int, noises: int, known: int, at_once: int) -> System:
    """Of n states, of which some are known exactly at the start, driven by fewer noises than states or none."""
    draw = np.random.default_rng(seed)
    A = draw.normal(size=(n, n))
    A[:known] = 0.0
    Phi = [expm(0.3 * draw.normal(size=(n, n))) for _ in range(steps)]
    G = [draw.normal(size=(n, noises)) * 10.0 ** draw.uniform(-2, 0) for _ in range(steps)]
    fixes: list[list[Fix]] = []
    for _ in range(steps):
        fixes.append([])
        for _ in range(draw.integers(0, at_once + 1)):
            rows = draw.integers(1, 3)
            B = draw.normal(size=(rows, rows))
            fixes[-1].append((draw.normal(size=rows), draw.normal(size=(rows, n)), B @ B.T + 0.1 * np.eye(int(rows))))
    return System(
        draw.normal(size=n), A @ A.T, Phi, [g @ g.T for g in G], [draw.normal(size=n) for _ in Phi], fixes
    )  # fmt: skip


SEED, SIZE, STEPS, AT_ONCE = st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(1, 8), st.integers(0, 3)


def assert_equal(system: System, kernel: ModuleType) -> None:
    """States and variances to 1e-9 of what they are without measurements."""
    states, sigma, prior = batch(system)
    found, own, filtered = smoothed(system, kernel)
    unit = np.maximum(prior, 1e-9 * np.max(prior, initial=1e-3))
    assert np.max(np.abs(found - states) / unit) < 1e-9
    assert np.max(np.abs(own**2 - sigma**2) / unit**2) < 1e-9
    assert np.all(own <= filtered + 1e-9 * unit)


@settings(max_examples=60, deadline=None)
@given(seed=SEED, n=SIZE, steps=STEPS, noises=st.integers(0, 5), known=st.integers(0, 5), at_once=AT_ONCE)
@also(seed=1, n=3, steps=5, noises=0, known=3, at_once=2)  # nothing is unknown
@also(seed=2, n=4, steps=6, noises=0, known=0, at_once=1)  # nothing is ever lost
@also(seed=3, n=5, steps=8, noises=1, known=2, at_once=2)  # all covariances are singular
@also(seed=1592240725, n=5, steps=5, noises=1, known=5, at_once=0)  # P of 1e-7 of what its factors are good for
def test_factors_are_right_whatever_is_singular(
    seed: int, n: int, steps: int, noises: int, known: int, at_once: int
) -> None:
    assert_equal(random_system(seed, n, steps, min(noises, n), min(known, n), at_once), ud)


@settings(max_examples=30, deadline=None)
@given(seed=SEED, n=SIZE, steps=STEPS, at_once=AT_ONCE)
def test_joseph_is_right_where_no_covariance_is_singular(seed: int, n: int, steps: int, at_once: int) -> None:
    assert_equal(random_system(seed, n, steps, n, 0, at_once), joseph)


def assert_same(run: Collected, system: System) -> None:
    assert run.smoothed is not None
    states, sigma, _ = batch(system)
    assert np.max(np.abs(run.smoothed.estimate - states[1:]) / sigma[1:]) < 1e-9
    np.testing.assert_allclose(run.smoothed.sigma, sigma[1:], rtol=1e-9)
    assert np.max(run.smoothed.sigma / run.sigma) < 1.0 + 1e-12
    np.testing.assert_array_equal(run.smoothed.estimate[-1], run.estimate[-1])
    np.testing.assert_allclose(run.smoothed.sigma[-1], run.sigma[-1], rtol=1e-14)


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("covariance", ["ud", "joseph"])
def test_tracker_with_gated_and_missing_fixes(example: Example, covariance: str, kernel: str) -> None:
    # Fixes at 2 Hz and speeds at 5 Hz make steps of 0.1 and 0.2 s, some with two measurements; the gate is narrow.
    problem = example(
        "tracker_smoothed", "source.duration=12 s", "estimator.gate=0.8", f"estimator.covariance={covariance}",
        f"estimator.kernel={kernel}",
    )  # fmt: skip
    record = load_record(problem)
    fix, speed = record.streams["fix"], record.streams["speed"]
    fix.values[5, 0] = fix.values[9, :] = fix.values[10, 1] = np.nan
    run = run_problem(problem, record=record)
    assert np.count_nonzero(run.disposition == 1) > 5 and np.count_nonzero(run.disposition == 3) == 1
    system = System(np.zeros(4), np.diag([2500.0, 2500.0, 25.0, 25.0]), [], [], [], [])
    now = run.prepared.steps.start
    for k, t in enumerate(run.prepared.steps.time):
        dt, now = t - now, float(t)
        Phi, Q = np.eye(4), np.zeros((4, 4))
        Phi[0, 2] = Phi[1, 3] = dt
        for i in (0, 1):
            Q[i, i], Q[i + 2, i + 2], Q[i, i + 2] = 0.09 * dt**3 / 3, 0.09 * dt, 0.09 * dt**2 / 2
            Q[i + 2, i] = Q[i, i + 2]
        fixes: list[Fix] = []
        for j, (stream, rows, r) in enumerate(((fix, [0, 1], 9.0), (speed, [2], 0.04))):
            if run.disposition[k, j] == FUSED:
                z = stream.values[int(np.argmin(np.abs(stream.time - t)))]
                there = np.isfinite(z)
                fixes.append((z[there], np.eye(4)[rows][there], r * np.eye(int(there.sum()))))
        for values, each in ((system.Phi, Phi), (system.Q, Q), (system.d, np.zeros(4))):
            values.append(each)
        system.fixes.append(fixes)
    assert {len(f) for f in system.fixes} == {0, 1, 2}
    assert_same(run, system)


def test_heated_thermal_model(example: Example) -> None:
    problem = example("thermal", "source.duration=600 s", "estimator.smoother={kind: fixed_interval}")
    record = load_record(problem)
    sensor = record.streams["case_sensor"]
    F = np.array([[-1 / 300, 1 / 300], [1 / 900, -1 / 900 - 1 / 1800]])

    def rate(_: float, y: FloatArray) -> FloatArray:
        Q = y[:4].reshape(2, 2)
        return np.concatenate([(F @ Q + Q @ F.T + np.diag([0.005**2, 0.01**2])).ravel(), F @ y[4:] + [0.02, 0.0]])

    made = solve_ivp(rate, (0.0, 5.0), np.zeros(6), rtol=1e-13, atol=1e-20).y[:, -1]
    steps = len(sensor.time)
    system = System(
        mean=np.zeros(2),
        P=np.diag([4.0, 4.0]),
        Phi=[expm(F * 5.0)] * steps,
        Q=[made[:4].reshape(2, 2)] * steps,
        d=[made[4:] * (0.0 if t <= 300.0 else 5.0) for t in sensor.time],
        fixes=[[(z, np.array([[0.0, 1.0]]), np.array([[0.04]]))] for z in sensor.values],
    )
    assert_same(run_problem(problem, record=record), system)


def test_a_covariance_that_health_inflates_is_a_jump_of_the_state(composed: Callable[[str], Problem]) -> None:
    # After three refused readings the prior's variance is added: 1-state random walk with as much noise at that instant.
    problem = composed(
        "estimfw: 1\nblocks: {x: {kind: random_walk, unit: m, sigma: 4 m, noise: 0.1 m/sqrt(s)}}\n"
        "measurements: {fix: {kind: direct, of: [{block: x}], noise: 0.5 m}}\n"
        "health: {rejected: {times: 3, then: inflate}}\n"
        "estimator: {kind: kalman, gate: 0.99, smoother: {kind: fixed_interval}}\n"
    )
    z = np.random.default_rng(1).normal(0.0, 0.5, 30) + np.where(np.arange(30) < 15, 0.0, 6.0)
    stream = Stream("fix", np.arange(1.0, 31.0), z[:, None], ("fix",), "sample", 1.0)
    run = run_problem(problem, record=Record({"fix": stream}, initial={"time": np.array(0.0)}))
    (event,) = (e for e in run.events if e.kind == "recovery")
    jumped = int(np.searchsorted(run.prepared.steps.time, event.time + 1e-6))
    assert np.all(run.disposition[jumped - 3 : jumped] == 1) and run.disposition[jumped] == FUSED
    dt = np.diff(run.prepared.steps.time, prepend=run.prepared.steps.start)
    one = np.ones((1, 1))
    system = System(
        mean=np.zeros(1), P=16.0 * one, Phi=[one] * len(dt), d=[np.zeros(1)] * len(dt),
        Q=[(0.01 * step + (16.0 if k == jumped else 0.0)) * one for k, step in enumerate(dt)],
        fixes=[[(v, one, 0.25 * one)] if c == FUSED else [] for v, c in zip(stream.values, run.disposition[:, 0], strict=True)],
    )  # fmt: skip
    assert_same(run, system)
