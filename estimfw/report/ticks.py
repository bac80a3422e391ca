"""Labels of axis ticks: as many decimals as their spacing needs, powers of ten only where zeros would not be counted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from matplotlib.ticker import Formatter, Locator, LogLocator, MaxNLocator

__all__ = ["LinearLabels", "LogLabels", "log_locator", "power_of_ten"]

SMALLEST, LARGEST = 1e-4, 1e5
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class LinearLabels(Formatter):
    """All labels of an axis with the same number of decimals; no offset and no factor apart from them."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return self.format_ticks([x])[0]

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """The labels of ticks at ``values``."""
        largest = max((abs(value) for value in values), default=0.0)
        if 0 < largest < SMALLEST or _spacing(values) >= LARGEST:
            return [power_of_ten(value) for value in values]
        decimals = _decimals(values)
        return [_minus(f"{value:.{decimals}f}") for value in values]


class LogLabels(Formatter):
    """Plain numbers near one, powers of ten far from it."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if 1e-3 <= x < 1e5 else power_of_ten(x)


def log_locator(decades: float) -> Locator:
    """Ticks at round numbers, at 1, 2, 5, at each power of ten or at every n-th: about five, whatever the range."""
    if decades < 0.9:
        return MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10])
    if decades < 2.2:
        return LogLocator(subs=(1.0, 2.0, 5.0))
    return LogLocator(numticks=6)


def power_of_ten(value: float) -> str:
    """Such as ``10⁻⁵`` or ``2.5·10⁻⁵``."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    digits, _, exponent = f"{value:.6e}".partition("e")
    power = f"10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    digits = digits.rstrip("0").rstrip(".")
    return _minus({"1": power, "-1": f"-{power}"}.get(digits, f"{digits}·{power}"))


def _decimals(values: Sequence[float]) -> int:
    """So many that neighbours differ and none is off by more than a hundredth of the spacing."""
    step = _spacing(values)
    for decimals in range(12):
        if all(abs(value - round(value, decimals)) < 0.01 * step for value in values):
            return decimals
    return 12


def _spacing(values: Sequence[float]) -> float:
    steps = [abs(b - a) for a, b in pairwise(values) if b != a]
    return min(steps, default=max((abs(value) for value in values), default=0.0)) or 1.0


def _minus(text: str) -> str:
    """With the sign of print, which is as wide as a plus."""
    return text.replace("-", "−")
