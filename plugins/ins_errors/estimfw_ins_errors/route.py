"""True ways of a vehicle over ground: nodes between which its velocity changes evenly, so that its acceleration is known exactly.

A ship at a steady speed and course, with changes of course and a sea that makes it surge and yaw; a car that stops and turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Leg", "Route", "Sea", "drive", "voyage"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Route:
    """Nodes (N + 1): time s, velocity (E, N) m/s, heading rad (not wrapped, clockwise from North); all even in between."""

    time: FloatArray
    velocity: FloatArray
    heading: FloatArray

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Velocity (K, 2), heading (K,), heading rate (K,) of the interval that ends at these instants (K,)."""
        V = np.stack([np.interp(time, self.time, self.velocity[:, i]) for i in range(2)], axis=-1)
        rate = np.diff(self.heading) / np.diff(self.time)
        before = np.clip(np.searchsorted(self.time, time - 1e-9) - 1, 0, rate.size - 1)
        return V, np.interp(time, self.time, self.heading), rate[before]


@dataclass(frozen=True, slots=True)
class Leg:
    """From ``time`` (s) on the course turns to ``course`` (rad), and the speed goes to ``speed`` (m/s)."""

    time: float
    course: float
    speed: float


@dataclass(frozen=True, slots=True)
class Sea:
    """Sinusoidal surge (m/s) along the course and yaw (rad) about it, with one period (s)."""

    surge: float
    yaw: float
    period: float


def voyage(time: FloatArray, legs: Sequence[Leg], turn_rate: float, acceleration: float, sea: Sea | None) -> Route:
    """A ship.

    Parameters
    ----------
    time : (N + 1,) array, s
        Of the nodes.
    legs : sequence of Leg
        The first holds from the start; a turn goes the shorter way round.
    turn_rate, acceleration : float, rad/s and m/s^2
    sea : Sea or None
    """
    course, speed = _towards(time, [leg.course for leg in legs], legs, turn_rate, 2.0 * np.pi), None
    speed = _towards(time, [leg.speed for leg in legs], legs, acceleration, 0.0)
    heading = course
    if sea is not None:
        phase = 2.0 * np.pi * time / sea.period
        speed, heading = speed + sea.surge * np.sin(phase), course + sea.yaw * np.sin(phase)
    return Route(time, speed[:, None] * np.stack([np.sin(course), np.cos(course)], axis=-1), heading)


def drive(
    time: FloatArray, rng: np.random.Generator, course: float, speed: float, stretch: float, stop: float, turn_rate: float,
    acceleration: float,
) -> Route:  # fmt: skip
    """A car: stretches of about ``stretch`` s at about ``speed`` m/s, after each a stop of about ``stop`` s or a turn, or both.

    The way is drawn by ``rng``; it begins standing, and heads for ``course``.
    """
    legs, at, heading = [Leg(0.0, course, 0.0)], 0.5 * stop, course
    while at < time[-1]:
        legs.append(Leg(at, heading, speed * rng.uniform(0.5, 1.2)))
        at += stretch * rng.uniform(0.5, 1.5)
        if rng.uniform() < 0.5:
            legs.append(Leg(at, heading, 0.0))
            at += speed / acceleration + stop * rng.uniform(0.5, 1.5)
        heading += rng.choice([-0.5, 0.5, 0.25, -0.25, 0.0]) * np.pi
    return voyage(time, legs, turn_rate, acceleration, None)


def _towards(time: FloatArray, goals: Sequence[float], legs: Sequence[Leg], rate: float, period: float) -> FloatArray:
    """Values that move at ``rate`` towards the goal of the leg that they are in; round the shorter way where they wrap."""
    knots, values = [time[0]], [goals[0]]
    for k, leg in enumerate(legs[1:], 1):
        now = float(np.interp(leg.time, knots, values))
        while knots[-1] > leg.time:  # the goal before was not reached
            knots.pop()
            values.pop()
        change = goals[k] - now
        if period:
            change -= period * np.round(change / period)
        knots += [leg.time, leg.time + max(abs(change) / rate, 1e-6)]
        values += [now, now + change]
    return np.interp(time, knots, values)
