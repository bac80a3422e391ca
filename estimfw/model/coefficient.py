"""Coefficients as data: sparse matrices whose entries are polynomials in the nominal.

Built with a small vocabulary (`identity`, `constant`, `scalar`, `vector`, `matrix`, `skew`, and ``+ - * @``). From a
coefficient is *derived*: what it needs, its zero pattern, whether it is constant, its LaTeX, its value for a nominal
with any leading axes, and (by `estimfw.plan.lowering`) tables for a compiled kernel.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.model import polynomial as poly
from estimfw.model.polynomial import Factor, Polynomial

__all__ = ["Coefficient", "constant", "identity", "matrix", "scalar", "skew", "vector", "zeros"]

FloatArray = NDArray[np.float64]
Entry = tuple[int, int, Polynomial]


@dataclass(frozen=True)
class Coefficient:
    """A matrix over the nominal.

    Attributes
    ----------
    shape : (int, int)
    entries : tuple of (row, column, polynomial)
        Sorted, without zeros. Two coefficients are equal when these are.
    form : str
        LaTeX of the expression it was built from, ``<f_n>`` standing for the symbol of the variable ``f_n``; not part of
        equality.
    """

    shape: tuple[int, int]
    entries: tuple[Entry, ...]
    form: str = field(default="", compare=False)

    # -- derived -------------------------------------------------------------------------------------------------

    @cached_property
    def factors(self) -> frozenset[Factor]:
        """Scalars of the nominal that it needs."""
        return frozenset(f for _, _, p in self.entries for _, factors in p for f in factors)

    @property
    def needs(self) -> frozenset[str]:
        """Names of the nominal variables that it needs."""
        return frozenset(name for name, _ in self.factors)

    @property
    def is_constant(self) -> bool:
        return not self.factors

    @property
    def is_zero(self) -> bool:
        return not self.entries

    @cached_property
    def pattern(self) -> NDArray[np.bool_]:
        """Where it can be other than zero, (rows, columns)."""
        live = np.zeros(self.shape, dtype=bool)
        for i, j, _ in self.entries:
            live[i, j] = True
        return live

    @property
    def isotropic(self) -> Polynomial | None:
        """p where the coefficient is p times the identity, else None: it commutes with every rotation."""
        rows, columns = self.shape
        if rows != columns or len(self.entries) != rows:
            return None
        first = self.entries[0][2]
        return first if all(i == j and p == first for i, j, p in self.entries) else None

    def evaluate(self, nominal: Mapping[str, ArrayLike]) -> FloatArray:
        """Value for a nominal.

        Parameters
        ----------
        nominal : mapping of str to array
            ``nominal[name]`` has the variable's shape behind any leading axes; all leading axes broadcast.

        Returns
        -------
        (..., rows, columns) array
        """
        arrays = {name: np.asarray(nominal[name], dtype=float) for name in self.needs}
        scalars = {(name, index): _scalar(arrays[name], index) for name, index in self.factors}
        lead = np.broadcast_shapes(*(a.shape for a in scalars.values()))
        value = np.zeros((*lead, *self.shape))
        for i, j, polynomial in self.entries:
            for c, factors in polynomial:
                product: FloatArray | float = c
                for factor in factors:
                    product = product * scalars[factor]
                value[..., i, j] += product
        return value

    # -- algebra -------------------------------------------------------------------------------------------------

    def __add__(self, other: Coefficient) -> Coefficient:
        if self.shape != other.shape:
            raise ValueError(f"shapes {self.shape} and {other.shape} do not add")
        form = f"{self.form} + {other.form}" if self.form and other.form else ""
        return _collect(self.shape, [*self.entries, *other.entries], form)

    def __neg__(self) -> Coefficient:
        return self * -1.0

    def __sub__(self, other: Coefficient) -> Coefficient:
        return self + (-other)

    def __mul__(self, factor: float | Coefficient) -> Coefficient:
        """By a number or by a 1x1 coefficient, from either side."""
        if isinstance(factor, Coefficient):
            if factor.shape != (1, 1) and self.shape == (1, 1):
                return factor * self
            if factor.shape != (1, 1):
                raise ValueError("only a scalar coefficient multiplies entry by entry; use @")
            p = factor.entries[0][2] if factor.entries else poly.ZERO
            form = f"{_factor_form(factor.form)}\\,{_factor_form(self.form)}" if factor.form and self.form else ""
        else:
            p = poly.canonical([(float(factor), ())])
            form = _scaled_form(float(factor), self.form)
        return _collect(self.shape, [(i, j, poly.multiply(p, q)) for i, j, q in self.entries], form)

    __rmul__ = __mul__

    def __matmul__(self, other: Coefficient) -> Coefficient:
        if self.shape[1] != other.shape[0]:
            raise ValueError(f"shapes {self.shape} and {other.shape} do not multiply")
        by_row: dict[int, list[tuple[int, Polynomial]]] = {}
        for k, j, q in other.entries:
            by_row.setdefault(k, []).append((j, q))
        products = [(i, j, poly.multiply(p, q)) for i, k, p in self.entries for j, q in by_row.get(k, [])]
        form = f"{_factor_form(self.form)}\\,{_factor_form(other.form)}" if self.form and other.form else ""
        return _collect((self.shape[0], other.shape[1]), products, form)

    @property
    def T(self) -> Coefficient:
        form = f"({self.form})^{{T}}" if self.form else ""
        return _collect(self.shape[::-1], [(j, i, p) for i, j, p in self.entries], form)

    def select(self, rows: Sequence[int], columns: Sequence[int]) -> Coefficient:
        """The given rows and columns, in that order."""
        row, column = {r: k for k, r in enumerate(rows)}, {c: k for k, c in enumerate(columns)}
        kept = [(row[i], column[j], p) for i, j, p in self.entries if i in row and j in column]
        return _collect((len(rows), len(columns)), kept, self.form)

    def embed(self, shape: tuple[int, int], row: int, column: int) -> Coefficient:
        """Placed at (row, column) of a larger zero matrix."""
        return Coefficient(shape, tuple((i + row, j + column, p) for i, j, p in self.entries), self.form)

    def substitute(self, values: Mapping[Factor, Polynomial]) -> Coefficient:
        """Factors replaced by polynomials (a variable held at a constant)."""
        if not any(f in values for f in self.factors):
            return self
        return _collect(self.shape, [(i, j, poly.substitute(p, values)) for i, j, p in self.entries], "")

    def __reduce__(self) -> tuple[type[Coefficient], tuple[object, ...]]:
        return Coefficient, (self.shape, self.entries, self.form)


def _scalar(value: FloatArray, index: tuple[int, ...]) -> FloatArray:
    where: Any = (Ellipsis, *index)
    return np.asarray(value[where])


def _collect(shape: tuple[int, int], entries: Iterable[Entry], form: str) -> Coefficient:
    merged: dict[tuple[int, int], list[Polynomial]] = {}
    for i, j, p in entries:
        merged.setdefault((i, j), []).append(p)
    summed = [(i, j, poly.add(*merged[i, j])) for i, j in sorted(merged)]
    return Coefficient(shape, tuple(e for e in summed if e[2]), form)


def _scaled_form(factor: float, form: str) -> str:
    if not form:
        return ""
    if factor == 1.0:
        return form
    return f"-{_factor_form(form)}" if factor == -1.0 else f"{factor:g}\\,{_factor_form(form)}"


def _factor_form(form: str) -> str:
    return f"({form})" if " + " in form or form.startswith("-") else form


def zeros(rows: int, columns: int) -> Coefficient:
    return Coefficient((rows, columns), (), "0")


def constant(values: ArrayLike) -> Coefficient:
    """A matrix of numbers, (rows, columns); a 1-D array is a column."""
    array = np.asarray(values, dtype=float)
    if array.ndim < 2:
        array = array.reshape(-1, 1)
    entries = [(int(i), int(j), poly.canonical([(float(array[i, j]), ())])) for i, j in np.ndindex(*array.shape)]
    return _collect((int(array.shape[0]), int(array.shape[1])), entries, "")


def identity(size: int = 3) -> Coefficient:
    """The identity; its LaTeX is silent in a product."""
    return Coefficient((size, size), tuple((i, i, ((1.0, ()),)) for i in range(size)), "I")


def scalar(name: str) -> Coefficient:
    """A scalar variable of the nominal as a 1x1 coefficient."""
    return Coefficient((1, 1), ((0, 0, ((1.0, ((name, ()),)),)),), f"<{name}>")


def vector(name: str, size: int = 3) -> Coefficient:
    """A vector variable of the nominal as a column."""
    return Coefficient((size, 1), tuple((i, 0, ((1.0, ((name, (i,)),)),)) for i in range(size)), f"<{name}>")


def matrix(name: str, shape: tuple[int, int] = (3, 3)) -> Coefficient:
    """A matrix variable of the nominal."""
    rows, columns = shape
    entries = tuple((i, j, ((1.0, ((name, (i, j)),)),)) for i in range(rows) for j in range(columns))
    return Coefficient(shape, entries, f"<{name}>")


def skew(name: str | Sequence[float]) -> Coefficient:
    """[v x] of a vector variable, or of three numbers: ``skew(v) @ u`` is v x u."""
    source = vector(name) if isinstance(name, str) else constant(list(name))
    v = {i: p for i, _, p in source.entries}
    layout = [(0, 1, 2, -1.0), (0, 2, 1, 1.0), (1, 0, 2, 1.0), (1, 2, 0, -1.0), (2, 0, 1, -1.0), (2, 1, 0, 1.0)]
    minus_one: Polynomial = ((-1.0, ()),)
    entries = [
        (i, j, v[k] if sign > 0 else poly.multiply(minus_one, v[k])) for i, j, k, sign in layout if v.get(k, poly.ZERO)
    ]
    inner = source.form or ", ".join(f"{x:g}" for x in ([] if isinstance(name, str) else name))
    return _collect((3, 3), entries, f"[{inner}\\times]")
