"""What a watcher of a run sees is enough to repeat its covariance step by step, whatever the kernel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.estimators.stretch import Stretch
from estimfw.run import run as runner
from estimfw.run.run import run_problem

Example = Callable[..., Problem]
RUNS = {
    "tracker": ("tracker", ("source.duration=30 s",)),
    "alignment": ("static_12", ("source.duration=60 s", "estimator.restarts=[20 s]")),
    "closed loop": ("static_12", ("source.duration=60 s", "policies=[]", "estimator={kind: kalman, loop: closed}")),
}


def repeated(stretch: Stretch) -> np.ndarray:
    """Covariances after each step by the textbook's formulas, from those at the beginning of the stretch."""
    plan, chunk = stretch.plan, stretch.chunk
    process, end = stretch.rows
    Phi, Q, _ = plan.transitions(process, chunk.inputs, chunk.dt, stretch.doublings)
    H, R = plan.design(end), plan.noise(chunk.interval)
    P, made = stretch.covariance_before, []
    for k in range(len(stretch)):
        if chunk.restart[k]:
            P = stretch.prior
        P = Phi[k] @ P @ Phi[k].T + Q[k]
        rows = stretch.usable[k]
        if rows.any():
            h, r = H[k][rows], R[k][np.ix_(rows, rows)]
            K = P @ h.T @ np.linalg.inv(h @ P @ h.T + r)
            A = np.eye(len(P)) - K @ h
            P = A @ P @ A.T + K @ r @ K.T
        made.append(P)
    return np.array(made)


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("case", RUNS)
def test_stretches_repeat_the_covariance(
    example: Example, monkeypatch: pytest.MonkeyPatch, case: str, kernel: str
) -> None:
    name, overrides = RUNS[case]
    monkeypatch.setattr(runner, "LONGEST_CHUNK", 25)
    seen: list[Stretch] = []
    run_problem(example(name, *overrides, f"estimator.kernel={kernel}"), watch=lambda _: [seen.append])
    assert len(seen) >= 3 and sum(len(s) for s in seen) >= 60
    for stretch in seen:
        P = stretch.result.covariance
        scale = np.sqrt(np.einsum("kii->ki", P))
        difference = (repeated(stretch) - P) / (scale[:, :, None] * scale[:, None, :])
        assert np.abs(difference).max() < 1e-8
