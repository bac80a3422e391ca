"""A coefficient as tables of numbers: what a kernel, in any language, evaluates without names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimfw.model.coefficient import Coefficient
from estimfw.plan.layout import NominalLayout

__all__ = ["Lowered", "Tables", "lower"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Tables(NamedTuple):
    """Monomials as arrays: entry, constant, and factor positions (k, degree); -1 stands for a factor 1."""

    entry: IntArray
    constant: FloatArray
    factors: IntArray


@dataclass(frozen=True, slots=True)
class Lowered:
    """value.flat[entry] += constant * product(row[factors]), over all monomials."""

    shape: tuple[int, int]
    monomials: tuple[tuple[int, float, tuple[int, ...]], ...]

    def evaluate(self, rows: FloatArray) -> FloatArray:
        """(..., rows, columns) for nominal rows (..., size)."""
        flat = np.zeros((*rows.shape[:-1], self.shape[0] * self.shape[1]))
        for entry, constant, factors in self.monomials:
            product: FloatArray | float = constant
            for position in factors:
                product = product * rows[..., position]
            flat[..., entry] += product
        return flat.reshape((*rows.shape[:-1], *self.shape))

    def tables(self) -> Tables:
        """For compiled kernels."""
        degree = max((len(f) for _, _, f in self.monomials), default=1) or 1
        factors = np.full((len(self.monomials), degree), -1, dtype=np.int64)
        for k, (_, _, positions) in enumerate(self.monomials):
            factors[k, : len(positions)] = positions
        entry = np.array([e for e, _, _ in self.monomials], dtype=np.int64)
        return Tables(entry, np.array([c for _, c, _ in self.monomials], dtype=float), factors)


def lower(coefficient: Coefficient, layout: NominalLayout) -> Lowered:
    """Names to positions.

    Raises
    ------
    ConfigError
        The nominal has no such variable.
    """
    columns = coefficient.shape[1]
    monomials = tuple(
        (i * columns + j, constant, tuple(layout.position(name, index) for name, index in factors))
        for i, j, polynomial in coefficient.entries
        for constant, factors in polynomial
    )
    return Lowered(coefficient.shape, monomials)
