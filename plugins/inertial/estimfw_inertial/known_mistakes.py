"""Mistakes that people make with the units of an IMU log, by the factor that each puts into the numbers; and their cure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

__all__ = ["DEG", "Mistake", "Sensor", "Values", "cure", "force_mistakes", "nearest", "rate_mistakes"]

Sensor = Literal["gyro", "accel"]
Values = Literal["increment", "rate"]

#: Degrees in a radian.
DEG = 180.0 / np.pi
_STANDARD_GRAVITY = 9.80665
#: What a config calls the units of rates, and of increments.
_UNITS: dict[Values, dict[str, str]] = {
    "rate": {"deg": "deg/s", "rad": "rad/s", "arcsec": "deg/h", "g": "g", "m/s^2": "m/s^2"},
    "increment": {"deg": "deg", "rad": "rad", "arcsec": "arcsec", "g": "g*s", "m/s^2": "m/s"},
}
_DOES_IT_STAND = "does the vehicle stand? `checks: false` takes the record as it is"


@dataclass(frozen=True, slots=True)
class Mistake:
    """Something that people do, by which the numbers come out ``factor`` times too large.

    ``values`` and ``unit`` say what the log really holds; None where that was right.
    """

    factor: float
    text: str
    values: Values | None = None
    unit: str | None = None


def force_mistakes(period: float) -> tuple[Mistake, ...]:
    """Of the accelerometers; ``period`` is the sampling interval in s."""
    g = _STANDARD_GRAVITY
    return (
        Mistake(1.0 / g, "g for m/s^2", unit="g"),
        Mistake(g, "m/s^2 for g", unit="m/s^2"),
        *_of_kind(period, 1.0, ""),
        *_of_kind(period, 1.0 / g, ", and g for m/s^2", "g"),
    )


def rate_mistakes(period: float) -> tuple[Mistake, ...]:
    """Of the gyros."""
    return (
        Mistake(DEG, "deg for rad", unit="deg"),
        Mistake(1.0 / DEG, "rad for deg", unit="rad"),
        Mistake(DEG * 3600.0, "arcsec for rad, or deg/h for rad/s", unit="arcsec"),
        *_of_kind(period, 1.0, ""),
        *_of_kind(period, DEG, ", and deg for rad", "deg"),
    )


def _of_kind(period: float, factor: float, more: str, unit: str | None = None) -> tuple[Mistake, ...]:
    return (
        Mistake(factor / period, f"rates taken for increments{more}", "rate", unit),
        Mistake(factor * period, f"increments taken for rates{more}", "increment", unit),
    )


def nearest(ratio: float, mistakes: tuple[Mistake, ...], tolerance: float) -> Mistake | None:
    """The mistake whose factor is within ``tolerance`` (relative) of the ratio, the nearest of them."""
    if not (np.isfinite(ratio) and ratio > 0.0):
        return None
    miss = {m: abs(float(np.log(ratio / m.factor))) for m in mistakes}
    best = min(mistakes, key=lambda m: miss[m])
    return best if miss[best] < tolerance and abs(np.log(best.factor)) > 2.0 * tolerance else None


def cure(guesses: Mapping[Sensor, Mistake | None], values: Values | None, contents: str) -> str:
    """What to say in the config.

    Parameters
    ----------
    guesses : mapping of sensor to Mistake or None
        Of the sensors that show something wrong.
    values : 'increment', 'rate' or None
        What the log was taken for; None where its format leaves nothing to say.
    contents : str
        What a log of such a format holds.
    """
    known = {sensor: guess for sensor, guess in guesses.items() if guess is not None}
    if not known:
        return _DOES_IT_STAND
    if values is None:
        return f"{contents}: correct the log"
    really = next((g.values for g in known.values() if g.values is not None), None)
    units = [f"{s}: {_UNITS[really or values][g.unit]}" for s, g in known.items() if g.unit is not None]
    says = [f"`values: {really}`"] * (really is not None) + [f"`units: {{{', '.join(units)}}}`"] * bool(units)
    hint = f"say {' and '.join(says)}"
    if really is not None and "gyro" not in known:
        hint += f", with the unit of the gyros (`units: {{gyro: {_UNITS[really]['deg']}}}`?)"
    return hint
