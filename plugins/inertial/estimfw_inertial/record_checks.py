"""Does a record of a standing IMU look like one? Gravity and the Earth's rate are known, so wrong units show.

A file says nothing of its units, and a filter fed with the wrong ones gives an answer all the same. On a standing vehicle
the mean specific force is gravity and the mean rate is the Earth's, and the angle between them is 90 deg minus latitude.
What misses them by a factor that a known mistake would make is refused, with the guess.
"""

from __future__ import annotations

import numpy as np

from estimfw.data.record import Event, FloatArray
from estimfw.errors import DataError, Location
from estimfw_inertial.earth import RATE, normal_gravity
from estimfw_inertial.known_mistakes import (
    DEG,
    Mistake,
    Sensor,
    Values,
    cure,
    force_mistakes,
    nearest,
    rate_mistakes,
)
from estimfw_inertial.place import Place
from estimfw_inertial.standing_means import StandingMeans
from estimfw_inertial.vertical_rate import vertical_rate_events

__all__ = ["check_standing", "check_step"]

_STANDARD_GRAVITY = 9.80665
#: Largest part by which the mean specific force of a standing, uncalibrated IMU misses gravity.
_FORCE_TOLERANCE = 0.03
#: A mean rate may be this many times the Earth's or this part of it: gyro biases are added to it.
_RATE_TOLERANCE = 3.0
#: rad/s; what no gyro has for a bias, but one read in the wrong unit.
_NO_BIAS = 0.02
#: How an IMU sits whose z is not up, but for its yaw, by the axis on which the reaction to gravity shows.
_TURNS = {"+x": "roll: -90 deg", "-x": "roll: 90 deg", "+y": "pitch: 90 deg", "-y": "pitch: -90 deg"}


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


def check_standing(
    means: StandingMeans,
    place: Place | None,
    location: Location,
    *,
    tolerance: float,
    values: Values | None = "increment",
    contents: str = "",
) -> tuple[Event, ...]:
    """Gravity and the Earth's rate, in size and direction.

    Parameters
    ----------
    means : StandingMeans
    place : Place or None
        None: standard gravity, and no check of the angle between the two.
    location : Location
        For the message.
    tolerance : float, rad/s
        By which the rate along gravity may miss the Earth's, beyond what averaging leaves of noise.
    values, contents
        For the cure of wrong units; see `cure`.

    Returns
    -------
    tuple of Event
        ``rate`` where the mean rate is not the Earth's but no known mistake either, ``vertical rate`` where it is not that
        of the latitude; ``tilt`` beyond 45 deg.

    Raises
    ------
    DataError
        The mean specific force is not gravity, the rate is that of a known mistake, or gravity lies along a wrong axis.
    """
    guesses, faults = _wrong_sizes(means, place)
    if faults:
        raise DataError("; ".join(faults), location=location, hint=cure(guesses, values, contents))
    events = _check_direction(means, place, location)
    rate = float(np.linalg.norm(means.rate_b))
    if 1.0 / _RATE_TOLERANCE < rate / RATE < _RATE_TOLERANCE:
        return (*events, *(vertical_rate_events(means, place, tolerance) if place is not None else ()))
    text = f"the mean rate is {rate * DEG * 3600.0:.4g} deg/h, the Earth's is 15.04: large gyro biases, or the vehicle turns"
    more = ", or the gyros are in deg, not in rad" if rate > _NO_BIAS else ""
    return (*events, Event(float("nan"), "imu", "rate", f"{text}{more}"))


def _wrong_sizes(means: StandingMeans, place: Place | None) -> tuple[dict[Sensor, Mistake | None], list[str]]:
    """By sensor the mistake that explains its mean, and what to tell of it."""
    gravity = float(normal_gravity(place.latitude, place.height)) if place is not None else _STANDARD_GRAVITY
    force, rate = float(np.linalg.norm(means.force_b)), float(np.linalg.norm(means.rate_b))
    guesses: dict[Sensor, Mistake | None] = {}
    faults = []
    if not abs(force / gravity - 1.0) < _FORCE_TOLERANCE:
        guesses["accel"] = nearest(force / gravity, force_mistakes(means.period), 0.05)
        seen = f"the mean specific force is {force:.5g} m/s^2, gravity is {gravity:.5g} m/s^2"
        faults.append(f"{seen}: {_told(guesses['accel'])}")
    if not 1.0 / _RATE_TOLERANCE < rate / RATE < _RATE_TOLERANCE:
        guess = nearest(rate / RATE, rate_mistakes(means.period), 0.15)
        if guess is not None and (faults or _angle_fits(means, place)):
            guesses = {"gyro": guess, **guesses}
            faults.append(f"the mean rate is {rate:.5g} rad/s, the Earth's is {RATE:.5g} rad/s: {_told(guess)}")
    return guesses, faults


def _told(guess: Mistake | None) -> str:
    if guess is None:
        return "this is no record of a standing vehicle in SI units"
    return f"{guess.text}? (factor {1.0 / guess.factor:.6g})"


def _angle_fits(means: StandingMeans, place: Place | None) -> bool:
    """Whether rate and specific force stand to each other as the Earth's do: a large bias would not."""
    return place is None or abs(means.sine_of_latitude - float(np.sin(place.latitude))) < 0.1


def _check_direction(means: StandingMeans, place: Place | None, location: Location) -> tuple[Event, ...]:
    up = means.up_b
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
    say = "say in `source.mounting` how the IMU sits in the vehicle, such as `mounting: "
    if name == "-z":
        raise DataError(
            f"{seen}: z points down?",
            location=location,
            hint=f"{say}{{yaw: -90 deg, roll: 180 deg}}` (x forward, y right, z down) or {{roll: 180 deg}} "
            "(x left, y forward, z down)",
        )
    raise DataError(
        f"{seen}: axes swapped?",
        location=location,
        hint=f"{say}{{{_TURNS[name]}}}` and its yaw; if the log only has its axes in another order, reorder them as right, "
        "forward, up (in `source.columns`, if it is CSV): a mounting turns, it cannot swap two axes",
    )


def _accelerometers_flipped(means: StandingMeans, place: Place | None) -> bool:
    if place is None or abs(np.sin(place.latitude)) < 0.2:
        return False
    return abs(means.sine_of_latitude + float(np.sin(place.latitude))) < 0.1
