"""What a plain YAML scalar means: the core schema of YAML 1.2, less what has no place in a config.

``12:30:45``, ``2024-01-01``, ``yes``, ``on`` and ``1_000`` are text; ``1e-3`` is a number; ``.nan``, ``.inf`` and numbers
that no float or 64-bit integer holds are refused.
"""

from __future__ import annotations

import math
import re

from estimfw.config.node import Scalar
from estimfw.errors import ConfigError, Location

__all__ = ["read_scalar"]

_WORDS: dict[str, Scalar] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
}  # fmt: skip
_INTEGER = re.compile(r"[-+]?[0-9]+")
_BASED = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_MAX_DIGITS = 19


def read_scalar(text: str, place: Location) -> Scalar:
    """The value of a plain (unquoted) scalar.

    Raises
    ------
    ConfigError
        For a number that is not finite or too large.
    """
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text) or _BASED.fullmatch(text):
        return _integer(text, place)
    if _NOT_FINITE.fullmatch(text):
        raise ConfigError(f"{text} is no finite number", location=place, hint="give a finite number")
    if _FLOAT.fullmatch(text):
        return _float(text, place)
    return text


def _integer(text: str, place: Location) -> int:
    shown = text if len(text) <= 40 else f"{text[:20]}..."
    number = int(text, 0 if _BASED.fullmatch(text) else 10) if len(text) <= _MAX_DIGITS + 3 else 2**63
    if abs(number) >= 2**63:
        raise ConfigError(f"the integer {shown} ({len(text)} characters) is too large", location=place,
                          hint="integers are below 2^63; write a float such as 1e20 for a larger number")  # fmt: skip
    return number


def _float(text: str, place: Location) -> float:
    number = float(text)
    if math.isinf(number):
        shown = text if len(text) <= 40 else f"{text[:20]}..."
        raise ConfigError(f"{shown} is too large for a number", location=place, hint="floats end at 1.8e308")
    return number
