"""How wrong each formula for the process noise of a step is, how fast that gets better, and whether it is a covariance at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.analysis.noise_formulas import FORMULAS, NoiseFormula, exact_noise
from estimfw.errors import NumericalError

__all__ = ["INDEFINITE", "DiscretisationStudy", "FormulaStudy", "smallest_eigenvalue", "study_discretisation"]

FloatArray = NDArray[np.float64]
LongArray = NDArray[np.longdouble]

#: An eigenvalue of a unit-diagonal Q below this is no rounding.
INDEFINITE = -1e-9
#: Relative errors below this are rounding: no order is told of them.
ROUNDING = 1e-12


@dataclass(frozen=True)
class FormulaStudy:
    """One formula over all steps (T,).

    Attributes
    ----------
    formula : NoiseFormula
    error, held_error : (T,) array
        Largest entry of Q less the exact Q of white noise, and less that of noise held over the step; each entry in units of the
        sigmas that the longest step gives its two states, so that errors of different steps can be laid beside each other.
    own_error : (T,) array
        The same against white noise in units of the step's own sigmas: 1 is as large as Q itself.
    eigenvalue : (T,) array
        Smallest one of Q, scaled as ``own_error``; negative where Q is no covariance.
    order, held_order : float
        Power of the step with which the two errors fall: between the shortest step at which they are no rounding, and half of
        it. NaN where there is none.
    """

    formula: NoiseFormula
    error: FloatArray
    held_error: FloatArray
    own_error: FloatArray
    eigenvalue: FloatArray
    order: float
    held_order: float

    @property
    def indefinite(self) -> NDArray[np.bool_]:
        """At which steps (T,) Q is no covariance."""
        return np.asarray(self.eigenvalue < INDEFINITE)


@dataclass(frozen=True)
class DiscretisationStudy:
    """All formulas; ``steps`` (T,) in s, ascending; ``sigma`` (T, n) is what the exact white noise brings in a step."""

    states: tuple[str, ...]
    steps: FloatArray
    sigma: FloatArray
    formulas: tuple[FormulaStudy, ...]


def smallest_eigenvalue(Q: ArrayLike, variance: ArrayLike) -> float:
    """Of Q (n, n) with each state in units of its sigma; states without variance (n,) are left out. 0 where none has any."""
    values, scale = np.asarray(Q, dtype=float), np.asarray(variance, dtype=float)
    live = scale > 0.0
    if not np.any(live):
        return 0.0
    unit = 1.0 / np.sqrt(scale[live])
    return float(np.linalg.eigvalsh(unit[:, None] * values[np.ix_(live, live)] * unit).min())


def study_discretisation(
    states: Sequence[str], F: FloatArray, D: FloatArray, steps: Sequence[float]
) -> DiscretisationStudy:
    """Hold the formulas against the exact noise.

    Parameters
    ----------
    states : sequence of n str
    F, D : (n, n) array
        Dynamics in 1/s, and diffusion.
    steps : sequence of float, s
        Positive; at least one.

    Raises
    ------
    NumericalError
        A step is so long for these dynamics that numbers overflow.
    """
    dt = np.unique(np.asarray(steps, dtype=float))
    each = np.concatenate([dt, 0.5 * dt])
    with np.errstate(over="ignore", invalid="ignore"):
        known = [exact_noise(F, D, float(t)) for t in each]
        white, held = (np.stack(part) for part in zip(*known, strict=True))
        made = [np.stack([one.noise(F, D, float(t)) for t in each]) for one in FORMULAS]
    for t, exact, *own in zip(each, white, *made, strict=True):
        if not all(np.all(np.isfinite(Q)) for Q in (exact, *own)):
            raise NumericalError(
                f"the noise of a step of {t:g} s is not finite: the dynamics are too fast for it",
                hint="leave out steps that long",
            )
    found = (_formula(one, Q, white, held) for one, Q in zip(FORMULAS, made, strict=True))
    sigma = np.sqrt(np.einsum("tii->ti", white[: dt.size]).astype(float))
    return DiscretisationStudy(tuple(states), dt, sigma, tuple(found))


def _formula(formula: NoiseFormula, Q: FloatArray, white: LongArray, held: LongArray) -> FormulaStudy:
    """All arrays (2 T, n, n): at the steps, then at half of each."""
    many = len(Q) // 2
    variance = np.einsum("tii->ti", white)
    longest = np.broadcast_to(variance[many - 1], variance.shape)
    size, error, held_error = (_largest(one, longest) for one in (white, Q - white, Q - held))
    return FormulaStudy(
        formula=formula,
        error=error[:many],
        held_error=held_error[:many],
        own_error=_largest(Q - white, variance)[:many],
        eigenvalue=np.array([smallest_eigenvalue(Q[t], variance[t]) for t in range(many)]),
        order=_order(error, size),
        held_order=_order(held_error, size),
    )


def _largest(matrices: LongArray, variances: LongArray) -> FloatArray:
    """Of each matrix (T, n, n) the largest entry, in units of the sigmas of its two states; those without variance left out."""
    unit = np.sqrt(np.divide(1.0, variances, out=np.zeros_like(variances), where=variances > 0))
    scaled = unit[:, :, None] * matrices * unit[:, None, :]
    return np.asarray(np.max(np.abs(scaled), axis=(1, 2), initial=0.0), dtype=float)


def _order(error: FloatArray, size: FloatArray) -> float:
    """Both (2 T,): at the steps, then at half of each."""
    long, short = error.reshape(2, -1)
    told = np.flatnonzero(np.all((error > ROUNDING * size).reshape(2, -1), axis=0))
    return float(np.log2(long[told[0]] / short[told[0]])) if told.size else float("nan")
