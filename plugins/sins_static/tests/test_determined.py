"""What the readings determine: ranks of the models, the triples that may go, and the 7 states as a quotient of the 10."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import null_space

from estimfw.config.compose import Problem
from estimfw.policies.prune_unobservable import model_observability

FloatArray = NDArray[np.float64]
Compose = Callable[..., Problem]

LEVEL: tuple[str, ...] = ("initial_attitude.yaw=0 deg", "initial_attitude.pitch=0 deg", "initial_attitude.roll=0 deg")
TILTED = ("initial_attitude.yaw=130 deg", "initial_attitude.pitch=20 deg", "initial_attitude.roll=-35 deg")
ATTITUDES = pytest.mark.parametrize("attitude", [LEVEL, TILTED], ids=["level", "tilted"])

FIX, CORIOLIS = "sins_static.constant_specific_force", "sins_static.remove_coriolis"
IN_N, FLAT = "sins_static.bias_in_navigation_frame", "sins_static.remove_vertical_channel"
PRUNE = "sins_static.prune_unobservable"


def policies(*kinds: str) -> str:
    return f"policies=[{', '.join(kinds)}]"


def numbers(problem: Problem) -> tuple[float, float, float]:
    """g, w_N, w_U as the provider has them at this site."""
    w = problem.reference["earth_rate_n"]
    assert w[0] == 0.0
    return float(problem.reference["gravity"]), float(w[1]), float(w[2])


def F_of(problem: Problem) -> FloatArray:
    return problem.model.F.coefficient.evaluate(problem.reference)


def rank_by_svd(F: FloatArray, H: FloatArray) -> int:
    """Of the stacked matrix in units in which g, the Earth rate and the biases are of order one."""
    blocks = [H]
    for _ in range(F.shape[0] - 1):
        blocks.append(blocks[-1] @ F)
    values = np.linalg.svd(np.vstack([b / np.abs(b).max() if b.any() else b for b in blocks]), compute_uv=False)
    return int(np.sum(values > 1e-6 * values[0]))


def scaled(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """F and H with time in 1/omega_ie, velocity in g/omega_ie, accelerations in g: dimensionless, all of order one."""
    omega, g = 7.292115e-5, float(problem.reference["gravity"])
    kinds = {"velocity_error": g / omega, "attitude_error": 1.0, "accel_bias": g, "gyro_bias": omega}
    unit = np.array([kinds[s.partition("[")[0]] for s in problem.model.states])
    H = problem.model.H("zero_velocity").coefficient.evaluate(problem.reference)
    return F_of(problem) * unit / unit[:, None] / omega, H


@ATTITUDES
@pytest.mark.parametrize(("example", "rank"), [("static_12", 9), ("static_10", 7), ("static_7", 7)])
@pytest.mark.parametrize("coriolis", [True, False])
def test_ranks_are_9_7_7(composed: Compose, attitude: tuple[str, ...], example: str, rank: int, coriolis: bool) -> None:
    kinds = [p["kind"] if isinstance(p, dict) else p for p in composed(example).config.policies]
    kinds = [k for k in kinds if k != CORIOLIS] + ([] if coriolis else [CORIOLIS])
    problem = composed(example, policies(*kinds), *attitude)
    assert model_observability(problem.model, problem.reference).rank == rank
    assert rank_by_svd(*scaled(problem)) == rank


@pytest.mark.parametrize("latitude", [1, 34, 85])
def test_the_removable_triples_are_three(composed: Compose, latitude: int) -> None:
    """Of all triples of biases in n, without Coriolis: those whose deletion leaves full rank."""
    problem = composed("static_12", policies(FIX, CORIOLIS, IN_N, FLAT), f"site.latitude={latitude} deg")
    F, H = scaled(problem)
    states = problem.model.states
    biases = [i for i, s in enumerate(states) if "bias" in s]
    removable = set()
    for i in biases:
        for j in biases:
            for k in biases:
                kept = [s for s in range(len(states)) if s not in (i, j, k)]
                if i < j < k and rank_by_svd(F[np.ix_(kept, kept)], H[:, kept]) == 7:
                    removable.add(tuple(states[s] for s in (i, j, k)))
    aE, aN, eE, eN, eU = "accel_bias[E]", "accel_bias[N]", "gyro_bias[E]", "gyro_bias[N]", "gyro_bias[U]"
    assert removable == {(aE, aN, eE), (aE, eE, eN), (aE, eE, eU)}


def quotient(g: float, wN: float, wU: float) -> FloatArray:
    """T of the paper's 7 states over dVE dVN phiE phiN phiU aE aN epsE epsN epsU, biases in n."""
    T = np.zeros((7, 10))
    T[[0, 1, 2, 3, 4, 5, 6], [0, 1, 2, 3, 4, 8, 9]] = 1.0
    T[2, 6] = 1.0 / g
    T[3, 5] = -1.0 / g
    T[4, 7], T[4, 5] = 1.0 / wN, -wU / wN / g
    T[5, 6] = -wU / g
    T[6, 6] = wN / g
    return T


@pytest.mark.parametrize("coriolis", [True, False])
@ATTITUDES
def test_the_7_states_are_the_observable_quotient_of_the_10(
    composed: Compose, coriolis: bool, attitude: tuple[str, ...]
) -> None:
    """T F10 = F7 T, H10 = H7 T, and the kernel of T is what cannot be seen."""
    drop = () if coriolis else (CORIOLIS,)
    ten = composed("static_12", policies(FIX, *drop, IN_N, FLAT), *attitude)
    seven = composed("static_12", policies(FIX, *drop, IN_N, FLAT, PRUNE), *attitude)
    T = quotient(*numbers(ten))
    F10, F7 = F_of(ten), F_of(seven)
    g, wN, _ = numbers(ten)
    size = np.abs(T) @ np.abs(F10) + np.abs(F7) @ np.abs(T)
    assert np.all(np.abs(T @ F10 - F7 @ T) <= 4e-16 * size)
    H10 = ten.model.H("zero_velocity").coefficient.evaluate({})
    assert np.array_equal(H10, seven.model.H("zero_velocity").coefficient.evaluate({}) @ T)
    unit = np.array([1.0] * 5 + [g] * 2 + [wN] * 3)
    kernel = null_space(T * unit)
    found = model_observability(ten.model, ten.reference).kernel / unit[:, None]
    assert kernel.shape[1] == found.shape[1] == 3
    assert np.linalg.matrix_rank(np.hstack([kernel, found / np.linalg.norm(found, axis=0)]), tol=1e-7) == 3
