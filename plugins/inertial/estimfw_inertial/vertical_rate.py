"""The rate of a standing IMU along gravity against that of the site's latitude, ``omega_ie sin L``.

Along the vertical a standing vehicle needs no attitude to be compared with: ``w . f / |f|`` is the Earth's rate there plus the
gyro bias there. So a wrong site shows, and so does a gyro triad of the wrong sign; but a bias of that size looks the same. It
is a flag, with what it may be, and never an error: a MEMS gyro misses by tens of deg/h, and is right.
"""

from __future__ import annotations

import numpy as np

from estimfw.data.record import Event
from estimfw_inertial.earth import RATE
from estimfw_inertial.known_mistakes import DEG
from estimfw_inertial.place import Place
from estimfw_inertial.standing_means import StandingMeans

__all__ = ["vertical_rate_events"]

_DEG_PER_H = DEG * 3600.0
#: Standard errors that averaging may leave.
_SIGMAS = 4.0
#: rad; how near the latitude that a record shows is to one that explains it.
_NEAR = np.radians(3.0)


def vertical_rate_events(means: StandingMeans, place: Place, tolerance: float) -> tuple[Event, ...]:
    """An event where the rate along gravity is not that of the latitude.

    Parameters
    ----------
    means : StandingMeans
    place : Place
    tolerance : float, rad/s
        What the gyro biases may do, beyond what averaging leaves of noise.
    """
    expected = RATE * float(np.sin(place.latitude))
    bias = means.vertical_rate - expected
    if abs(bias) <= tolerance + _SIGMAS * means.vertical_sigma:
        return ()
    text = (
        f"the rate along gravity is {means.vertical_rate * _DEG_PER_H:.3g} deg/h, at latitude "
        f"{np.degrees(place.latitude):.4g} deg the Earth's is {expected * _DEG_PER_H:.3g} deg/h: "
        f"{_cause(means, place)}, or a gyro bias of {bias * _DEG_PER_H:.3g} deg/h along the vertical?"
    )
    return (Event(float("nan"), "imu", "vertical rate", text),)


def _cause(means: StandingMeans, place: Place) -> str:
    seen = float(np.arcsin(np.clip(means.sine_of_latitude, -1.0, 1.0)))
    if abs(seen + place.latitude) < _NEAR:
        return "the sign of the latitude, or of the gyros"
    if abs(seen - place.longitude) < _NEAR:
        return "latitude and longitude swapped"
    return f"another latitude (the log looks like {np.degrees(seen):.0f} deg), axes of gyros and accelerometers that differ"
