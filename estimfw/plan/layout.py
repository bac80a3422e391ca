"""The nominal row: which variable stands where in the flat array."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.errors import ConfigError
from estimfw.model.derived import DerivedVariable, derived_value
from estimfw.model.nominal import NominalVariable
from estimfw.spelling import did_you_mean

__all__ = ["NominalLayout"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class NominalLayout:
    """The provider's variables one after the other (C order), then the derived ones.

    A derived variable varies as the worst of what it needs.
    """

    variables: tuple[NominalVariable, ...]
    derived: tuple[DerivedVariable, ...] = ()

    @cached_property
    def provided(self) -> int:
        """Width of the provider's part of a row."""
        return sum(v.size for v in self.variables)

    @cached_property
    def size(self) -> int:
        return self.provided + sum(int(np.prod(d.shape, dtype=int)) for d in self.derived)

    @cached_property
    def _offsets(self) -> dict[str, tuple[int, tuple[int, ...]]]:
        result: dict[str, tuple[int, tuple[int, ...]]] = {}
        at = 0
        shapes = [(v.name, v.shape) for v in self.variables] + [(d.name, d.shape) for d in self.derived]
        for name, shape in shapes:
            result[name] = (at, shape)
            at += int(np.prod(shape, dtype=int))
        return result

    def places(self, name: str) -> range:
        """The positions in a row of all scalars of a variable."""
        at, shape = self._offsets[name]
        return range(at, at + int(np.prod(shape, dtype=int)))

    def position(self, name: str, index: tuple[int, ...]) -> int:
        """Where one scalar stands in a row.

        Raises
        ------
        ConfigError
            The provider has no such variable.
        """
        offsets = self._offsets
        if name not in offsets:
            raise ConfigError(
                f"the model needs the nominal variable {name!r}, which the nominal provider does not make",
                hint=did_you_mean(name, offsets) + "; or hold it with the policy fix_nominal",
            )
        at, shape = offsets[name]
        return at + (int(np.ravel_multi_index(index, shape)) if shape else 0)

    def changes(self, name: str) -> str:
        """``constant``, ``stepped`` or ``varying``."""
        for v in self.variables:
            if v.name == name:
                return v.changes
        for d in self.derived:
            if d.name == name:
                order = ("constant", "stepped", "varying")
                return order[max((order.index(self.changes(need)) for need in d.reads), default=0)]
        return "constant"

    def unpack(self, rows: FloatArray) -> dict[str, FloatArray]:
        """Views of the variables in rows (..., size), with their shapes behind the leading axes."""
        result = {}
        for name, (at, shape) in self._offsets.items():
            size = int(np.prod(shape, dtype=int))
            if at + size <= rows.shape[-1]:
                result[name] = rows[..., at : at + size].reshape((*rows.shape[:-1], *shape))
        return result

    def pack(self, nominal: Mapping[str, ArrayLike]) -> FloatArray:
        """One row (provided part) from the variables."""
        parts = [np.ravel(np.asarray(nominal[v.name], dtype=float)) for v in self.variables]
        return np.concatenate(parts) if parts else np.zeros(0)

    def complete(self, rows: FloatArray, only: Collection[str] | None = None) -> FloatArray:
        """Rows with the derived variables appended; the rows themselves where there are none.

        ``only`` these (with those that they are made of) where it is given; the others are NaN.
        """
        if not self.derived:
            return rows
        whole = np.full((*rows.shape[:-1], self.size), np.nan)
        whole[..., : self.provided] = rows
        values = self.unpack(whole)
        for d in self.derived if only is None else [d for d in self.derived if d.name in only]:
            values[d.name][...] = derived_value(d, values, rows.shape[:-1])
        return whole

    def reasons(self, names: Iterable[str]) -> list[str]:
        """Which of these are not constant."""
        return sorted(n for n in names if self.changes(n) != "constant")
