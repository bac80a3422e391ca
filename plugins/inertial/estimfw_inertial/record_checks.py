"""Does a record of a standing IMU look like one? Gravity and the Earth's rate are known, so wrong units show.

A file says nothing of its units, and a filter fed with the wrong ones gives an answer all the same. On a standing vehicle
the mean specific force is gravity and the mean rate is the Earth's, and the angle between them is 90 deg minus latitude.
What misses them by a factor that a known mistake would make is refused, with the guess.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event
from estimfw.errors import DataError, Location
from estimfw_inertial.earth import RATE, normal_gravity
from estimfw_inertial.place import Place

__all__ = ["StandingMeans", "check_standing", "check_step"]

FloatArray = NDArray[np.float64]

_STANDARD_GRAVITY = 9.80665
_DEG = 180.0 / np.pi
#: Largest part by which the mean specific force of a standing, uncalibrated IMU misses gravity.
_FORCE_TOLERANCE = 0.03
#: A mean rate may be this many times the Earth's or this part of it: gyro biases are added to it.
_RATE_TOLERANCE = 3.0


@dataclass(frozen=True, slots=True)
class StandingMeans:
    """Means of a standing record.

    Attributes
    ----------
    force_b : (3,) array, m/s^2
    rate_b : (3,) array, rad/s
    period : float, s
    """

    force_b: FloatArray
    rate_b: FloatArray
    period: float

    @classmethod
    def of(cls, values: FloatArray, period: float) -> StandingMeans:
        """Means of increments (N, 6), rad and m/s, over ``period`` s each; NaN is left out."""
        mean = np.nanmean(values, axis=0) / period
        return cls(mean[3:6], mean[:3], period)


@dataclass(frozen=True, slots=True)
class _Mistake:
    """Something that people do, by which the number comes out ``factor`` times too large."""

    factor: float
    text: str
    hint: str


def check_step(time: FloatArray, location: Location) -> float:
    """The median step of the time stamps (N,) s, where nothing says the sampling interval.

    Raises
    ------
    DataError
        One row only, or a second and more: an IMU is faster, but milliseconds look like that.
    """
    if time.size < 2:
        raise DataError("one row tells no sampling interval", location=location, hint="say `rate`")
    step = float(np.median(np.diff(time)))
    if step >= 1.0:
        raise DataError(
            f"the time stamps are {step:.6g} s apart: time in ms, not in s?",
            location=location,
            hint="say the unit of time (`units: {time: ms}`), or `rate` if the IMU is that slow",
        )
    return step


def check_standing(means: StandingMeans, place: Place | None, location: Location) -> tuple[Event, ...]:
    """Gravity and the Earth's rate, in size and direction.

    Parameters
    ----------
    means : StandingMeans
    place : Place or None
        None: standard gravity, and no check of the angle between the two.
    location : Location
        For the message.

    Returns
    -------
    tuple of Event
        ``rate`` where the mean rate is not the Earth's but no known mistake either; ``tilt`` beyond 45 deg.

    Raises
    ------
    DataError
        The mean specific force is not gravity, the rate is that of a known mistake, or gravity lies along a wrong axis.
    """
    gravity = float(normal_gravity(place.latitude, place.height)) if place is not None else _STANDARD_GRAVITY
    _check_sizes(means, gravity, place, location)
    events = _check_direction(means, place, location)
    rate = float(np.linalg.norm(means.rate_b))
    if 1.0 / _RATE_TOLERANCE < rate / RATE < _RATE_TOLERANCE:
        return events
    text = f"the mean rate is {rate * _DEG * 3600.0:.4g} deg/h, the Earth's is 15.04: large gyro biases, or the vehicle turns"
    return (*events, Event(float("nan"), "imu", "rate", text))


def _check_sizes(means: StandingMeans, gravity: float, place: Place | None, location: Location) -> None:
    force, rate = float(np.linalg.norm(means.force_b)), float(np.linalg.norm(means.rate_b))
    faults = []
    if not abs(force / gravity - 1.0) < _FORCE_TOLERANCE:
        guess = _nearest(force / gravity, _force_mistakes(means.period), 0.05)
        faults.append((f"the mean specific force is {force:.5g} m/s^2, gravity is {gravity:.5g} m/s^2", guess))
    if not 1.0 / _RATE_TOLERANCE < rate / RATE < _RATE_TOLERANCE:
        guess = _nearest(rate / RATE, _rate_mistakes(means.period), 0.15)
        if guess is not None and (faults or _angle_fits(means, place)):
            faults.append((f"the mean rate is {rate:.5g} rad/s, the Earth's is {RATE:.5g} rad/s", guess))
    if faults:
        text = "; ".join(f"{seen}: {_told(guess)}" for seen, guess in faults)
        hints = dict.fromkeys(guess.hint if guess else _NO_GUESS for _, guess in faults)
        raise DataError(text, location=location, hint="; ".join(hints))


_NO_GUESS = "does the vehicle stand? `checks: false` takes the record as it is"


def _told(guess: _Mistake | None) -> str:
    return (
        f"{guess.text}? (factor {1.0 / guess.factor:.6g})"
        if guess
        else "this is no record of a standing vehicle in SI units"
    )


def _force_mistakes(period: float) -> tuple[_Mistake, ...]:
    g = _STANDARD_GRAVITY
    return (
        _Mistake(1.0 / g, "g for m/s^2", "say the unit of the accelerometers (g)"),
        *_kind_mistakes(period, 1.0, ""),
        *_kind_mistakes(period, 1.0 / g, ", and g for m/s^2"),
    )


def _rate_mistakes(period: float) -> tuple[_Mistake, ...]:
    return (
        _Mistake(_DEG, "deg for rad", "say the unit of the gyros (deg)"),
        _Mistake(_DEG * 3600.0, "arcsec for rad, or deg/h for rad/s", "say the unit of the gyros (arcsec, deg/h)"),
        *_kind_mistakes(period, 1.0, ""),
        *_kind_mistakes(period, _DEG, ", and deg for rad"),
    )


def _kind_mistakes(period: float, factor: float, more: str) -> tuple[_Mistake, ...]:
    return (
        _Mistake(factor / period, f"rates taken for increments{more}", "say `values: rate`"),
        _Mistake(factor * period, f"increments taken for rates{more}", "say `values: increment`"),
    )


def _nearest(ratio: float, mistakes: tuple[_Mistake, ...], tolerance: float) -> _Mistake | None:
    """The mistake whose factor is within ``tolerance`` of the ratio, the nearest of them."""
    if not (np.isfinite(ratio) and ratio > 0.0):
        return None
    miss = {m: abs(float(np.log(ratio / m.factor))) for m in mistakes}
    best = min(mistakes, key=lambda m: miss[m])
    return best if miss[best] < tolerance and abs(np.log(best.factor)) > 2.0 * tolerance else None


def _angle_fits(means: StandingMeans, place: Place | None) -> bool:
    """Whether rate and specific force stand to each other as the Earth's do: a large bias would not."""
    return place is None or abs(_sine_of_latitude(means) - float(np.sin(place.latitude))) < 0.1


def _sine_of_latitude(means: StandingMeans) -> float:
    size = float(np.linalg.norm(means.force_b) * np.linalg.norm(means.rate_b))
    return float(means.force_b @ means.rate_b) / size if size > 0.0 else 0.0


def _check_direction(means: StandingMeans, place: Place | None, location: Location) -> tuple[Event, ...]:
    up = means.force_b / np.linalg.norm(means.force_b)
    axis = int(np.argmax(np.abs(up)))
    name = f"{'+' if up[axis] > 0.0 else '-'}{'xyz'[axis]}"
    if abs(up[axis]) < np.sqrt(0.5) or name == "+z":
        tilt = float(np.degrees(np.arccos(np.clip(up[2], -1.0, 1.0))))
        return (Event(float("nan"), "imu", "tilt", f"the IMU is tilted by {tilt:.3g} deg"),) if tilt > 45.0 else ()
    seen = f"the reaction to gravity shows on {name}, not on +z"
    if name == "-z" and _accelerometers_flipped(means, place):
        raise DataError(
            f"{seen}, and the Earth's rate does not: the signs of the accelerometers are flipped",
            location=location,
            hint="at rest an accelerometer that points up shows +g: turn the signs round in the log",
        )
    guess = "z points down" if name == "-z" else "axes swapped"
    raise DataError(
        f"{seen}: {guess}?", location=location, hint="say in `source.mounting` how the IMU sits in the vehicle"
    )


def _accelerometers_flipped(means: StandingMeans, place: Place | None) -> bool:
    if place is None or abs(np.sin(place.latitude)) < 0.2:
        return False
    return abs(_sine_of_latitude(means) + float(np.sin(place.latitude))) < 0.1
