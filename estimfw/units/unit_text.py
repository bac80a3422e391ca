"""Read a unit such as ``m/s/sqrt(Hz)``: a small recursive-descent reader that evaluates nothing else."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NoReturn

from estimfw.errors import ConfigError
from estimfw.spelling import did_you_mean
from estimfw.units.table import ALIASES, SPELLED_OUT, UNITS
from estimfw.units.unit import Dimension, Scale, Unit

__all__ = ["MAX_TEXT", "parse_unit"]

#: Characters; a longer text is no unit.
MAX_TEXT = 120
_MAX_DEPTH = 6
_MAX_POWER = 30
#: Of a scale: far beyond any float, far below what takes time.
_MAX_BITS = 4096

_TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-zµμ°%]+)|(?P<power>\*\*|\^)|(?P<number>\d+(?:\.\d+)?)|(?P<small>[⁻⁺]?[⁰¹²³⁴-⁹]|½)"
    r"|(?P<sign>[*/()√·×+−-]))"
)
_SUPERSCRIPTS = str.maketrans("⁻⁺⁰¹²³⁴⁵⁶⁷⁸⁹", "-+0123456789")
_ONE = Unit(Scale(), Dimension())


def parse_unit(text: str) -> Unit:
    """Read a unit.

    Parameters
    ----------
    text : str
        Such as ``deg/sqrt(h)``; ``1`` (or nothing) is the unit of plain numbers.

    Raises
    ------
    ConfigError
        With the offending text and the nearest unit.
    """
    if len(text) > MAX_TEXT:
        raise ConfigError(f"{text[:20]!r}... is too long for a unit ({len(text)} characters)")
    return _Reader(text).read()


class _Reader:
    """The tokens of one text and where we stand in them."""

    def __init__(self, text: str) -> None:
        self.text = text.strip()
        self.tokens = self._split()
        self.depth = 0

    def read(self) -> Unit:
        if not self.tokens:
            return _ONE
        unit = self._product()
        if self.tokens:
            self._refuse(f"unexpected {self.tokens[0]!r}")
        return Unit(unit.scale, unit.dimension, self.text)

    def _split(self) -> list[str]:
        tokens, place = [], 0
        while place < len(self.text):
            found = _TOKEN.match(self.text, place)
            if found is None:
                self._refuse(f"unexpected {self.text[place:].strip()[:10]!r}")
            tokens.append(found.group().strip())
            place = found.end()
        return tokens

    def _refuse(self, reason: str) -> NoReturn:
        raise ConfigError(
            f"cannot read the unit {self.text!r}: {reason}",
            hint="write names joined by * and /, such as m/s^2, deg/h, deg/sqrt(h), ug/sqrt(Hz)",
        )

    def _next_is(self, *tokens: str) -> bool:
        return bool(self.tokens) and self.tokens[0] in tokens

    def _take(self) -> str:
        if not self.tokens:
            self._refuse("it ends too early")
        return self.tokens.pop(0)

    def _product(self) -> Unit:
        unit = _ONE if self._next_is("/") else self._powered()
        while self._next_is("*", "·", "×", "/"):
            divide = self._take() == "/"
            factor = self._powered()
            unit = unit * (factor.power(Fraction(-1)) if divide else factor)
        return unit

    def _powered(self) -> Unit:
        unit = self._atom()
        if self._next_is("^", "**"):
            self._take()
            unit = self._raise(unit, self._exponent())
        elif self.tokens and (self.tokens[0] == "½" or self.tokens[0][-1] in "⁰¹²³⁴⁵⁶⁷⁸⁹"):
            small = self._take()
            unit = self._raise(unit, Fraction(1, 2) if small == "½" else Fraction(small.translate(_SUPERSCRIPTS)))
        if self._next_is("^", "**"):
            self._refuse("a power of a power")
        return unit

    def _raise(self, unit: Unit, exponent: Fraction) -> Unit:
        bits = max(unit.scale.squared.numerator.bit_length(), unit.scale.squared.denominator.bit_length())
        if abs(exponent) > _MAX_POWER or bits * abs(exponent) > _MAX_BITS:
            self._refuse(f"the power {exponent} is too large")
        try:
            return unit.power(exponent)
        except ValueError as cause:
            self._refuse(str(cause))

    def _exponent(self) -> Fraction:
        if not self._next_is("("):
            return self._signed_number()
        self._take()
        exponent = self._signed_number()
        if self._next_is("/"):
            self._take()
            below = self._signed_number()
            if below == 0:
                self._refuse("a power of 1/0")
            exponent /= below
        self._close()
        return exponent

    def _signed_number(self) -> Fraction:
        sign = -1 if self._next_is("-", "−") else 1
        if self._next_is("-", "−", "+"):
            self._take()
        token = self._take()
        if not token[0].isdigit() or not token.isascii() or len(token) > 5:
            self._refuse(f"{token!r} is no power")
        return sign * Fraction(token)

    def _atom(self) -> Unit:
        token = self._take()
        if token == "1":
            return _ONE
        if token == "(":
            return self._parenthesis()
        if token == "√":
            return self._raise(self._atom(), Fraction(1, 2))
        if token == "sqrt":
            if self._take() != "(":
                self._refuse("sqrt needs a parenthesis: sqrt(h)")
            return self._raise(self._parenthesis(), Fraction(1, 2))
        name = ALIASES.get(token, token)
        if name not in UNITS:
            meant = SPELLED_OUT.get(token.lower())
            self._refuse(f"no unit {token!r}; {f'write {meant!r}' if meant else did_you_mean(token, UNITS)}")
        return UNITS[name]

    def _parenthesis(self) -> Unit:
        self.depth += 1
        if self.depth > _MAX_DEPTH:
            self._refuse("too many parentheses")
        unit = self._product()
        self._close()
        self.depth -= 1
        return unit

    def _close(self) -> None:
        if self._take() != ")":
            self._refuse("a parenthesis is not closed")
