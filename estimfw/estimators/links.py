"""What joins each step of a filter with the one before it, for a smoother: see `estimfw.kernels.smooth`.

Only estimates, covariances and transitions are read, so it does not matter how many measurements a step had, which were gated
or missing, and how long it was. Where the filter is told something new between two steps, that is known:

* Closed loop: what the provider was corrected by is taken off the estimate, and the corrections of a smoother, which are
  differences, stay what they are.
* A restart begins anew from the prior, which says that nothing of before is known. So nothing that comes after says anything of
  what was before: the smoother is cut there, and the last estimate before a restart is the filter's.
* A covariance that is larger at the begin of a stretch than at the end of the one before (`health`: inflate) says that the state
  may have jumped in between: that is noise of the step after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.stretch import Stretch
from estimfw.kernels import ud

__all__ = ["Linker", "Links"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Links:
    """From K steps to the one before each: correction u <- gain u + shift, covariance P <- gain P gain' + rest.

    ``gain`` and ``rest`` (K, n, n), ``shift`` (K, n); ``form`` (K, n, n) is the filter's covariance after each step. ``rest`` and
    ``form`` are factored, see `estimfw.kernels.ud`.
    """

    gain: FloatArray
    shift: FloatArray
    rest: FloatArray
    form: FloatArray

    def __len__(self) -> int:
        return int(self.shift.shape[0])


class Linker:
    """Makes the links of a run, stretch by stretch, the first of each to the step before it.

    Parameters
    ----------
    kernel : module
        `estimfw.kernels.smooth` or its compiled twin.
    factored : bool
        The filter's covariance has the form U D U'.
    """

    def __init__(self, kernel: ModuleType, *, factored: bool) -> None:
        self._kernel, self._factored = kernel, factored
        self._last: FloatArray | None = None

    def __call__(self, stretch: Stretch) -> Links:
        """The links of a stretch of a filter that keeps its moves."""
        moves, result = stretch.result.moves, stretch.result
        assert moves is not None
        begin = self._factor(stretch.before.form)
        last, noise = begin if self._last is None else self._last, moves.noise
        if not np.array_equal(last, begin):
            noise = noise.copy()
            added = moves.transition[0] @ (ud.covariance(begin) - ud.covariance(last)) @ moves.transition[0].T
            noise[0] += 0.5 * (added + added.T)
        form = np.concatenate([last[None], self._factor(moves.form)])
        gain, rest = self._kernel.gain(form[:-1], moves.transition, noise)
        predicted = (moves.transition @ _begun(stretch)[..., None])[..., 0] + moves.drift
        shift = (gain @ (result.estimate - predicted)[..., None])[..., 0]
        for k in np.flatnonzero(stretch.chunk.restart):
            gain[k], shift[k], rest[k] = 0.0, 0.0, form[k]
        self._last = form[-1]
        return Links(gain, shift, rest, form[1:])

    def _factor(self, form: FloatArray) -> FloatArray:
        """U D U' (..., n, n); what rounding left below zero of a covariance kept whole is nothing."""
        if self._factored:
            return form
        made = ud.factor(form)
        D = np.einsum("...ii->...i", made)
        D[...] = np.maximum(D, 0.0)
        return made


def _begun(stretch: Stretch) -> FloatArray:
    """The estimate with which each step begins (K, n): where the provider was corrected, without what corrected it."""
    taken = np.outer(stretch.corrected[:-1], stretch.plan.corrected).astype(bool)
    after = np.where(taken, 0.0, stretch.result.estimate[:-1])
    return np.concatenate([stretch.before.x[None], after])
