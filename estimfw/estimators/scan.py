"""What a recursion takes and gives: settings, the carried state, a chunk of steps, and what became of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import NumericalError
from estimfw.plan.plan import Plan

__all__ = [
    "Chunk",
    "ChunkResult",
    "FilterSettings",
    "FilterState",
    "Moves",
    "SubSteps",
    "lost",
    "refuse_lost",
    "row_offsets",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """How the recursion is done.

    Attributes
    ----------
    covariance : 'ud' or 'joseph'
    closed_loop : bool
        After each step with a fused measurement the provider is corrected and the corrected states are reset to zero; the
        covariance is carried over. Otherwise that happens at restarts only.
    moves : bool
        The result keeps how each step moved the state: a smoother goes back over it.
    """

    covariance: Literal["ud", "joseph"] = "ud"
    closed_loop: bool = False
    moves: bool = False


@dataclass(frozen=True, slots=True)
class FilterState:
    """Everything that goes from one step to the next: a snapshot, a checkpoint.

    ``x`` (..., n), ``form`` (..., n, n) is the covariance in the kernel's form, ``provider`` (..., n_state), ``row``
    (..., provided) the nominal at the end of the step before, or at the start.
    """

    x: FloatArray
    form: FloatArray
    provider: FloatArray
    row: FloatArray


@dataclass(frozen=True, slots=True)
class Chunk:
    """Inputs of K steps.

    ``samples`` (K, n_sample), ``dt`` (K,) s, ``restart`` (K,) bool, ``inputs`` (K, known inputs); and over all measurements of
    the plan one behind the other: ``readings`` (K, rows), NaN where there is none and 0 for a pseudo-measurement, ``due``
    (K, measurements) bool, ``interval`` (K, measurements) s. ``time`` (K,) s are the ends of the steps.
    """

    samples: FloatArray
    dt: FloatArray
    restart: NDArray[np.bool_]
    inputs: FloatArray
    readings: FloatArray
    due: NDArray[np.bool_]
    interval: FloatArray
    time: FloatArray

    def __len__(self) -> int:
        return int(self.dt.shape[0])


@dataclass(frozen=True, slots=True)
class Moves:
    """How K steps moved the state: x <- transition x + drift + w, E[w w'] = noise.

    ``transition`` and ``noise`` (K, n, n), ``drift`` (K, n); a step of no length leaves all as it is. ``form`` (K, n, n) is the
    covariance after the step in the kernel's form.
    """

    transition: FloatArray
    noise: FloatArray
    drift: FloatArray
    form: FloatArray

    @classmethod
    def none(cls, steps: int, n: int) -> Moves:
        """Of so many steps that leave all as it is."""
        identity = np.broadcast_to(np.eye(n), (steps, n, n)).copy()
        return cls(identity, np.zeros((steps, n, n)), np.zeros((steps, n)), np.empty((steps, n, n)))


@dataclass(frozen=True, slots=True)
class ChunkResult:
    """Outcome of K steps.

    ``estimate`` (K, n) and ``covariance`` (K, n, n) after the updates of a step and *before* a correction of the provider;
    ``rows`` (K, provided) the nominal at the end of the step and ``provider`` (K, n_state) the provider's state there, before
    it too. ``disposition`` (K, measurements) is -1 where none was due. ``log_det`` (K, measurements) is ln det S of what was
    fused or gated, NaN else: with the NIS it makes the likelihood of a measurement, -2 ln p = NIS + ln det S + m ln 2 pi.
    ``moves`` only where the settings ask for them.
    """

    estimate: FloatArray
    covariance: FloatArray
    rows: FloatArray
    provider: FloatArray
    innovation: FloatArray
    sigma: FloatArray
    nis: FloatArray
    disposition: IntArray
    used: IntArray
    log_det: FloatArray
    moves: Moves | None = None

    @classmethod
    def empty(cls, plan: Plan, steps: int, n_state: int, moves: bool = False) -> ChunkResult:
        """Of so many steps, before they are done: nothing was due."""
        n, rows, many = len(plan.states), row_offsets(plan)[-1], len(plan.measurements)
        return cls(
            estimate=np.empty((steps, n)),
            covariance=np.empty((steps, n, n)),
            rows=np.empty((steps, plan.layout.provided)),
            provider=np.empty((steps, n_state)),
            innovation=np.full((steps, rows), np.nan),
            sigma=np.full((steps, rows), np.nan),
            nis=np.full((steps, many), np.nan),
            disposition=np.full((steps, many), -1, dtype=np.int64),
            used=np.zeros((steps, many), dtype=np.int64),
            log_det=np.full((steps, many), np.nan),
            moves=Moves.none(steps, n) if moves else None,
        )


def row_offsets(plan: Plan) -> list[int]:
    """Where each measurement's rows start among all rows; the last entry is their number."""
    offsets = [0]
    for m in plan.measurements:
        offsets.append(offsets[-1] + m.rows)
    return offsets


class SubSteps:
    """How often a step of a given length is halved, by the dynamics at the start; found once a length.

    See `estimfw.plan.discretisation.Discretisation.doublings`.
    """

    def __init__(self, plan: Plan, initial_row: FloatArray) -> None:
        self.plan, self.F = plan, plan.F.evaluate(plan.layout.complete(initial_row))
        self.known: dict[float, int] = {}

    def __call__(self, dt: float) -> int:
        """NumericalError where the dynamics are too stiff."""
        if dt not in self.known:
            self.known[dt] = self.plan.discretisation.doublings(self.F, dt)
        return self.known[dt]


def lost(result: ChunkResult) -> NDArray[np.bool_]:
    """Which states (K, n) left the numbers: not finite, a negative variance, or a correlation above one."""
    variance = np.einsum("kii->ki", result.covariance)
    good = np.isfinite(result.estimate) & np.isfinite(variance) & (variance >= -1e-30)
    with np.errstate(invalid="ignore", over="ignore"):
        most = np.sqrt(np.maximum(variance[:, :, None] * variance[:, None, :], 0.0))
        scale = np.sqrt(np.max(np.abs(variance), axis=0, initial=0.0))
        slack = 1e-6 * most + 1e-9 * scale[:, None] * scale
        good &= ~np.any(np.abs(result.covariance) > most + slack, axis=2)
    return np.asarray(~good)


def refuse_lost(plan: Plan, result: ChunkResult, first: int, time: FloatArray) -> None:
    """Raise where estimate or covariance left the numbers.

    Parameters
    ----------
    plan : Plan
    result : ChunkResult
    first : int
        Steps before this chunk.
    time : (K,) array, s
        Ends of its steps.

    Raises
    ------
    NumericalError
        An estimate is not finite, a variance negative, or a correlation above one: with the step and the state.
    """
    bad = lost(result)
    if not np.any(bad):
        return
    k, i = np.argwhere(bad)[0]
    variance = np.einsum("kii->ki", result.covariance)
    raise NumericalError(
        f"the filter left the numbers at step {first + k + 1} (t = {time[k]:g} s): "
        f"{plan.states[i]} = {result.estimate[k, i]:g}, variance {variance[k, i]:g}",
        hint="use estimator: {kind: kalman, covariance: ud}, and discretisation.method: van_loan",
    )
