"""A number that counts the products and quotients in which it takes part, and leaves out those that straight-line code would."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Counted", "Objects", "Tally", "counted", "values_of"]

FloatArray = NDArray[np.float64]
Objects = NDArray[Any]


@dataclass
class Tally:
    """Multiplications and divisions so far."""

    products: int = 0


class Counted:
    """A number, and the tally that it writes to; one that is ``known`` to be 0 or +-1 makes no product.

    It does what a float does in ``+ - * / -x``, also in arrays of objects (``A @ B``, ``np.outer``).
    """

    __slots__ = ("known", "tally", "value")

    def __init__(self, value: float, tally: Tally, *, known: bool = False) -> None:
        self.value, self.tally, self.known = value, tally, known

    def __add__(self, other: Any) -> Counted:
        if other.__class__ is not Counted:
            return NotImplemented  # an array: it does it element by element
        if self.known and self.value == 0.0:
            return other
        if other.known and other.value == 0.0:
            return self
        return Counted(self.value + other.value, self.tally)

    def __neg__(self) -> Counted:
        return Counted(-self.value, self.tally, known=self.known)

    def __sub__(self, other: Any) -> Counted:
        return NotImplemented if other.__class__ is not Counted else self + -other

    def __mul__(self, other: Any) -> Counted:
        if other.__class__ is not Counted:
            return NotImplemented  # an array: it does it element by element
        for one, rest in ((self, other), (other, self)):
            if one.known and one.value == 0.0:
                return one
            if one.known and abs(one.value) == 1.0:
                return rest if one.value == 1.0 else -rest
        self.tally.products += 1
        return Counted(self.value * other.value, self.tally)

    def __truediv__(self, other: Any) -> Counted:
        if other.__class__ is not Counted:
            return NotImplemented  # an array: it does it element by element
        if self.known and self.value == 0.0:
            return self
        self.tally.products += 1
        return Counted(self.value / other.value, self.tally)

    def __rtruediv__(self, other: float) -> Counted:
        self.tally.products += 1
        return Counted(other / self.value, self.tally)


def counted(values: FloatArray, tally: Tally, *, known: bool = False) -> Objects:
    """The array of such numbers; ``known``: its zeros and +-1 are there by structure."""
    made = np.empty(values.shape, dtype=object)
    for index, value in np.ndenumerate(values):
        made[index] = Counted(float(value), tally, known=known and abs(value) in (0.0, 1.0))
    return made


def values_of(numbers: Objects) -> FloatArray:
    """The floats in it."""
    return np.array([one.value for one in numbers.ravel()]).reshape(numbers.shape)
