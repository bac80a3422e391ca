"""The observability Gramian in square-root form: information about the state at the start, row by row, in units of the prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import NumericalError

__all__ = ["Gramian", "GramianValues", "whitened_rows"]

FloatArray = NDArray[np.float64]

#: Of a measurement without noise: its noise variance over the variance that the prior gives it.
PERFECT = 1e-16


@dataclass(frozen=True, slots=True)
class GramianValues:
    """Singular values of the square root of a whitened Gramian.

    Attributes
    ----------
    singular : (n,) array
        Largest first. s means: without process noise the prior sigma of that combination shrinks to 1 / sqrt(1 + s^2) of it.
    directions : (n, n) array
        Rows: the combinations, in whitened states.
    tolerance : float
        What rounding leaves of nothing.
    """

    singular: FloatArray
    directions: FloatArray
    tolerance: float

    @property
    def rank(self) -> int:
        return int(np.sum(self.singular > self.tolerance))

    @property
    def informed(self) -> int:
        """Combinations of which the measurements tell more than the prior."""
        return int(np.sum(self.singular > 1.0))

    @property
    def smallest_kept(self) -> float:
        """0 where there is none."""
        return float(self.singular[self.rank - 1]) if self.rank else 0.0

    @property
    def largest_rejected(self) -> float:
        return float(self.singular[self.rank]) if self.rank < self.singular.size else 0.0


class Gramian:
    """S with S^T S = sum over k of A_k^T H_k^T R_k^-1 H_k A_k, where A_k = Phi(k, 0) L, P0 = L L^T; the sum is never formed.

    Squared, a combination that is known ten thousand times less than another would be lost in the rounding.
    """

    def __init__(self, root: FloatArray) -> None:
        self._root = root
        self.transition = root.copy()
        """A_k (n, n) of the last step."""
        self._S = np.zeros((0, root.shape[0]))
        self._steps = 0

    def add(self, Phi: FloatArray, H: FloatArray, R: FloatArray, usable: NDArray[np.bool_]) -> FloatArray:
        """Go on by K steps.

        Parameters
        ----------
        Phi : (K, n, n) array
        H : (K, m, n) array
        R : (K, m, m) array
        usable : (K, m) array of bool
            Rows that were fused.

        Returns
        -------
        (K, n, n) array
            A_k at the end of each step.

        Raises
        ------
        NumericalError
            The transition grows beyond all numbers.
        """
        along = np.empty_like(Phi)
        with np.errstate(over="ignore", invalid="ignore"):
            for k, step in enumerate(Phi):
                self.transition = along[k] = step @ self.transition
        if not np.all(np.isfinite(self.transition)):
            raise NumericalError(
                "the dynamics grow beyond all numbers over the record", hint="they are unstable; shorten the record"
            )
        rows = whitened_rows(H, R, usable, self._root)
        seen = [np.einsum("kmi,kij->kmj", W, along[own]).reshape(-1, self._S.shape[1]) for own, W in rows]
        self._S = np.asarray(np.linalg.qr(np.vstack([self._S, *seen]), mode="r"))
        self._steps += len(Phi)
        return along

    def values(self) -> GramianValues:
        n = self._S.shape[1]
        _, singular, directions = np.linalg.svd(np.vstack([self._S, np.zeros((n, n))]), full_matrices=False)
        tolerance = np.finfo(float).eps * max(self._steps, 10 * n) * float(singular[0])
        return GramianValues(singular, directions, tolerance)


def whitened_rows(
    H: FloatArray, R: FloatArray, usable: NDArray[np.bool_], root: FloatArray
) -> list[tuple[NDArray[np.intp], FloatArray]]:
    """For each pattern of usable rows: its steps (K',), and R^-1/2 H there, (K', rows, n)."""
    made = []
    for pattern in np.unique(usable, axis=0):
        if not pattern.any():
            continue
        own = np.flatnonzero(np.all(usable == pattern, axis=1))
        h, r = H[own][:, pattern], R[own][:, pattern][:, :, pattern]
        open_variance = np.sum((h @ root) ** 2, axis=2)
        floor = np.where(
            np.einsum("kmm->km", r) > 0.0, 0.0, PERFECT * np.where(open_variance > 0.0, open_variance, 1.0)
        )
        r = r + floor[:, :, None] * np.eye(r.shape[-1])
        made.append((own, np.linalg.solve(np.linalg.cholesky(r), h)))
    return made
