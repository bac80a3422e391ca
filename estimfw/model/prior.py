"""The prior: mean and full labelled covariance, carried through frame changes and deletions.

Kept as ``P = T P0 T^T`` with ``P0`` numbers over the states first declared and ``T`` a coefficient over the nominal at
the start: a frame change composes a rotation into ``T``, a deletion takes rows of it.
So a plan needs no data, and an attitude found by alignment still rotates the prior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient

__all__ = ["Prior", "check_covariance"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Prior:
    """Mean and covariance of the states at the start.

    Attributes
    ----------
    mean0 : tuple of float
        Over the declared states, SI.
    covariance0 : tuple of tuple of float
    transform : Coefficient
        (states, declared states).
    """

    mean0: tuple[float, ...]
    covariance0: tuple[tuple[float, ...], ...]
    transform: Coefficient

    def evaluate(self, nominal: Mapping[str, ArrayLike]) -> tuple[FloatArray, FloatArray]:
        """Mean (..., n) and covariance (..., n, n) for a nominal at the start."""
        t = self.transform.evaluate(nominal)
        mean = np.einsum("...ij,j->...i", t, np.array(self.mean0))
        covariance = t @ np.array(self.covariance0).reshape(len(self.mean0), len(self.mean0)) @ np.swapaxes(t, -1, -2)
        return mean, 0.5 * (covariance + np.swapaxes(covariance, -1, -2))

    def select(self, rows: Sequence[int]) -> Prior:
        """The marginal over some states."""
        t = self.transform
        return Prior(self.mean0, self.covariance0, t.select(list(rows), list(range(t.shape[1]))))

    def rotate(self, rows: Sequence[int], rotation: Coefficient) -> Prior:
        """A triad of states (positions ``rows``) expressed in another frame.

        An isotropic triad without mean or correlations is left as it is: a rotation does not change it.
        """
        t = self.transform
        own = t.select(list(rows), list(range(t.shape[1])))
        if self._is_turned_into_itself(rows, own):
            return self
        turned = rotation @ own
        kept = [e for e in t.entries if e[0] not in set(rows)]
        moved = [(rows[i], j, p) for i, j, p in turned.entries]
        entries = tuple(sorted(kept + moved, key=lambda e: e[:2]))
        return Prior(self.mean0, self.covariance0, Coefficient(t.shape, entries))

    def _is_turned_into_itself(self, rows: Sequence[int], own: Coefficient) -> bool:
        """Whether ``own`` (3, declared states) @ x0 has no mean, one variance and no correlation with anything.

        That is so for an isotropic P0 of its own and an orthonormal ``own``, whatever the rotation.
        """
        columns = sorted({j for _, j, _ in own.entries})
        shared = any(j in columns and i not in rows for i, j, _ in self.transform.entries)
        if shared or not own.is_constant or len(columns) != 3 or any(self.mean0[j] for j in columns):
            return False
        M = own.evaluate({})[:, columns]
        block = np.array(self.covariance0)[np.ix_(columns, range(own.shape[1]))]
        alone = np.zeros_like(block)
        alone[:, columns] = np.eye(3) * block[0, columns[0]]
        return np.array_equal(block, alone) and np.allclose(M @ M.T, np.eye(3), rtol=0.0, atol=1e-12)


def check_covariance(covariance: FloatArray, labels: Sequence[str], what: str = "the prior covariance") -> None:
    """Refuse what is no covariance: not finite, not symmetric, not positive semidefinite. ``what`` names it in the message.

    Raises
    ------
    ConfigError
        With the worst eigenvalue, of the matrix scaled to unit diagonal, and the state that weighs most in it.
    """
    if not np.all(np.isfinite(covariance)):
        raise ConfigError(f"{what} is not finite")
    worst = np.max(np.abs(covariance - covariance.T), initial=0.0)
    scale = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    if worst > 1e-9 * max(float(np.max(scale, initial=0.0)) ** 2, 1e-300):
        i, j = divmod(int(np.argmax(np.abs(covariance - covariance.T))), len(labels))
        raise ConfigError(f"{what} is not symmetric: {labels[i]} and {labels[j]} differ by {worst:.3g}")
    unit = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    if values.size and values[0] < -1e-9:
        state = labels[int(np.argmax(np.abs(vectors[:, 0])))]
        raise ConfigError(
            f"{what} is not positive semidefinite: worst eigenvalue {values[0]:.3g} (unit diagonal)",
            hint=f"{state} weighs most in it; check the correlations given for it",
        )
