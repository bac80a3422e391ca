"""Numbers as people write them: a value to the two digits that its sigma leaves of it."""

from __future__ import annotations

import math

__all__ = ["UNKNOWN", "count", "instant", "measured", "plain", "plus_minus", "significant"]

UNKNOWN = "–"
SMALLEST, LARGEST = 1e-4, 1e7


def plus_minus(value: float, sigma: float) -> tuple[str, str]:
    """Value and sigma as text, to two significant digits of the sigma: ``(179.982, 0.061)``.

    An unknown or zero sigma leaves six significant digits of the value.
    """
    if not math.isfinite(sigma) or sigma <= 0:
        return significant(value, 6), significant(sigma, 2)
    if sigma < SMALLEST or sigma >= LARGEST:
        return significant(value, 4), significant(sigma, 2)
    decimals = max(0, 1 - math.floor(math.log10(float(f"{sigma:.1e}"))))
    return (_fixed(value, decimals) if math.isfinite(value) else UNKNOWN), f"{sigma:.{decimals}f}"


def significant(value: float, digits: int) -> str:
    """``digits`` significant digits, with an exponent only where it is needed."""
    if not math.isfinite(value):
        return UNKNOWN
    if value != 0 and not SMALLEST <= abs(value) < LARGEST:
        return f"{value:.{digits - 1}e}"
    rounded = float(f"{value:.{digits - 1}e}")
    decimals = digits - 1 - (math.floor(math.log10(abs(rounded))) if rounded else 0)
    return _fixed(value, max(0, decimals))


def plain(value: float) -> str:
    """Four significant digits without trailing zeros: a duration, a ratio."""
    return f"{value:.4g}" if math.isfinite(value) else UNKNOWN


def count(number: int) -> str:
    """A whole number with thin spaces between thousands."""
    return f"{number:,}".replace(",", "\u2009")


def instant(time: float) -> str:
    """Of a record, in s to the millisecond: whole however late, with thin spaces between thousands."""
    if not math.isfinite(time):
        return UNKNOWN
    text = f"{float(_fixed(time, 3)):,.3f}".rstrip("0").removesuffix(".")
    return text.replace(",", "\u2009")


def measured(name: str, value: float, unit: str) -> str:
    """A named number in a sentence: ``drift of gyro_bias 0 rad/s``; "SI" for a unit that depends on the case."""
    shown = "(SI)" if unit == "SI" else unit
    return f"{name} {value:.3g} {shown if value or unit != 'SI' else ''}".strip()


def _fixed(value: float, decimals: int) -> str:
    """Without the sign of what rounds to zero."""
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0 else text
