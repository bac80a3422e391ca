"""Numbers as people write them: a value to the two digits that its sigma leaves of it."""

from __future__ import annotations

import math

__all__ = ["UNKNOWN", "count", "plain", "plus_minus", "significant"]

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
    return (f"{value:.{decimals}f}" if math.isfinite(value) else UNKNOWN), f"{sigma:.{decimals}f}"


def significant(value: float, digits: int) -> str:
    """``digits`` significant digits, with an exponent only where it is needed."""
    if not math.isfinite(value):
        return UNKNOWN
    if value != 0 and not SMALLEST <= abs(value) < LARGEST:
        return f"{value:.{digits - 1}e}"
    decimals = digits - 1 - (math.floor(math.log10(abs(value))) if value else 0)
    return f"{value:.{max(0, decimals)}f}"


def plain(value: float) -> str:
    """Four significant digits without trailing zeros: a time, a ratio."""
    return f"{value:.4g}" if math.isfinite(value) else UNKNOWN


def count(number: int) -> str:
    """A whole number with thin spaces between thousands."""
    return f"{number:,}".replace(",", "\u2009")
