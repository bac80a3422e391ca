"""What joins each step of a filter with the one before it, for a smoother: see `estimfw.kernels.smooth`.

Only estimates, covariances and transitions are read, so it does not matter how many measurements a step had, which were gated
or missing, and how long it was. Where the filter is told something new between two steps, that is known:

* Closed loop: what the provider was corrected by is taken off the estimate, and the corrections of a smoother, which are
  differences, stay what they are.
* A restart begins anew from the prior, which says that nothing of before is known. So nothing that comes after says anything of
  what was before: the smoother is cut there, and the last estimate before a restart is the filter's.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.stretch import Stretch
from estimfw.kernels import ud

__all__ = ["Links", "links_of"]

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


def links_of(stretch: Stretch, kernel: ModuleType, *, factored: bool) -> Links:
    """The links of a stretch of a run, the first to the step before it.

    Parameters
    ----------
    stretch : Stretch
        Of a filter that keeps its moves.
    kernel : module
        `estimfw.kernels.smooth` or its compiled twin.
    factored : bool
        The filter's covariance has the form U D U'.
    """
    moves, result = stretch.result.moves, stretch.result
    assert moves is not None
    form = np.concatenate([stretch.before.form[None], moves.form])
    form = form if factored else ud.factor(form)
    gain, rest = kernel.gain(form[:-1], moves.transition, moves.noise)
    predicted = np.einsum("kij,kj->ki", moves.transition, _begun(stretch)) + moves.drift
    shift = np.einsum("kij,kj->ki", gain, result.estimate - predicted)
    for k in np.flatnonzero(stretch.chunk.restart):
        gain[k], shift[k] = 0.0, 0.0
        rest[k] = form[k]
    return Links(gain, shift, rest, form[1:])


def _begun(stretch: Stretch) -> FloatArray:
    """The estimate with which each step begins (K, n): where the provider was corrected, without what corrected it."""
    taken = np.outer(stretch.corrected[:-1], stretch.plan.corrected).astype(bool)
    after = np.where(taken, 0.0, stretch.result.estimate[:-1])
    return np.concatenate([stretch.before.x[None], after])
