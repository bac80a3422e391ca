"""A unit: an exact scale to SI and an exact dimension."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction

__all__ = ["BASES", "Dimension", "Scale", "Unit"]

#: The SI units that everything is expressed in, in the order in which they are written.
BASES: tuple[str, ...] = ("kg", "rad", "m", "A", "K", "s")


@dataclass(frozen=True, slots=True)
class Dimension:
    """Exponents of ``BASES``, counted in halves: m/s^1.5 is (0, 0, 2, 0, 0, -3)."""

    halves: tuple[int, ...] = (0,) * len(BASES)

    def __mul__(self, other: Dimension) -> Dimension:
        return Dimension(tuple(a + b for a, b in zip(self.halves, other.halves, strict=True)))

    def power(self, exponent: Fraction) -> Dimension:
        """The dimension to a power.

        Raises
        ------
        ValueError
            Where an exponent would be no multiple of one half.
        """
        powers = [h * exponent for h in self.halves]
        if any(p.denominator != 1 for p in powers):
            raise ValueError("exponents of units are multiples of one half")
        return Dimension(tuple(int(p) for p in powers))

    @property
    def is_none(self) -> bool:
        return not any(self.halves)

    def __str__(self) -> str:
        """SI text that ``parse_unit`` reads back: ``m/s^2``, ``rad/sqrt(s)``, ``1``."""
        above = [_factor(b, h) for b, h in zip(BASES, self.halves, strict=True) if h > 0]
        below = [_factor(b, -h) for b, h in zip(BASES, self.halves, strict=True) if h < 0]
        return "/".join(["*".join(above) or "1", *below])


def _factor(base: str, halves: int) -> str:
    if halves == 1:
        return f"sqrt({base})"
    if halves == 2:
        return base
    return f"{base}^{halves // 2}" if halves % 2 == 0 else f"{base}^{halves / 2:g}"


@dataclass(frozen=True, slots=True)
class Scale:
    """The exact positive number ``sqrt(squared) * pi**(pi_halves / 2)``: closed under products and square roots."""

    squared: Fraction = Fraction(1)
    pi_halves: int = 0

    @classmethod
    def of(cls, factor: Fraction | int, *, pi: int = 0) -> Scale:
        return cls(Fraction(factor) ** 2, 2 * pi)

    def __mul__(self, other: Scale) -> Scale:
        return Scale(self.squared * other.squared, self.pi_halves + other.pi_halves)

    def power(self, exponent: Fraction) -> Scale:
        """The scale to a power that is a multiple of one half.

        Raises
        ------
        ValueError
            Where the root of the root is asked for.
        """
        doubled = exponent * 2
        root = Scale(_root(self.squared), 0) if self.is_rational else None
        if doubled.denominator == 1 and doubled % 2 == 0:
            return Scale(self.squared ** int(exponent), self.pi_halves * int(exponent))
        if doubled.denominator == 1 and root is not None and self.pi_halves % 2 == 0:
            return Scale(root.squared ** int(doubled), self.pi_halves * int(doubled) // 2)
        raise ValueError("exponents of units are multiples of one half")

    @property
    def is_rational(self) -> bool:
        """Whether the factor of the power of pi is a rational number."""
        return _is_square(self.squared.numerator) and _is_square(self.squared.denominator)

    def times(self, number: Fraction) -> float:
        """``number * self``, rounded once where the scale is rational; ``OverflowError`` where it is no float."""
        pi = math.pow(math.pi, self.pi_halves / 2)
        if self.is_rational:
            return float(number * _root(self.squared)) * pi
        return float(number) * math.sqrt(self.squared) * pi

    def __float__(self) -> float:
        return self.times(Fraction(1))


def _is_square(number: int) -> bool:
    return math.isqrt(number) ** 2 == number


def _root(squared: Fraction) -> Fraction:
    return Fraction(math.isqrt(squared.numerator), math.isqrt(squared.denominator))


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit; equal to another one when scale and dimension are, however they are written.

    Attributes
    ----------
    scale : Scale
        One of this unit in SI.
    dimension : Dimension
    text : str
        As it was written.
    """

    scale: Scale
    dimension: Dimension
    text: str = field(default="", compare=False)

    def __mul__(self, other: Unit) -> Unit:
        return Unit(self.scale * other.scale, self.dimension * other.dimension)

    def power(self, exponent: Fraction) -> Unit:
        """The unit to a power; ``ValueError`` where an exponent is no multiple of one half."""
        return Unit(self.scale.power(exponent), self.dimension.power(exponent))

    @property
    def si_text(self) -> str:
        return str(self.dimension)

    def __str__(self) -> str:
        return self.text or self.si_text
