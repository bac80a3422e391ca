"""The route of a drive, drawn at random: speed and heading over time, of changes of speed, stops and turns in a row."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["Change", "Route", "drawn_route"]

FloatArray = NDArray[np.float64]
Kind = Literal["turn", "stop", "speed"]

#: Largest slope of a smooth step of height 1 over a time of 1.
STEEPEST = 1.875
#: Nothing is quicker than this: what a driver does lasts longer than 2 s.
QUICKEST = 2.5


@dataclass(frozen=True, slots=True)
class Change:
    """A smooth step of the speed (m/s) or the heading (rad) between two instants (s)."""

    begin: float
    length: float
    size: float

    def at(self, time: FloatArray) -> FloatArray:
        """size (10 x^3 - 15 x^4 + 6 x^5) of x in 0..1: speed and acceleration are continuous."""
        x = np.clip((time - self.begin) / self.length, 0.0, 1.0)
        return np.asarray(self.size * x**3 * (10.0 - 15.0 * x + 6.0 * x * x))


@dataclass(frozen=True, slots=True)
class Route:
    """``speed`` in m/s and ``heading`` in rad at the start, and their changes."""

    speed: float
    heading: float
    speed_changes: tuple[Change, ...]
    turns: tuple[Change, ...]

    def speed_at(self, time: FloatArray) -> FloatArray:
        """m/s, never negative."""
        return np.maximum(self.speed + sum((c.at(time) for c in self.speed_changes), np.zeros(time.shape)), 0.0)

    def heading_at(self, time: FloatArray) -> FloatArray:
        """rad, clockwise from North."""
        return self.heading + sum((c.at(time) for c in self.turns), np.zeros(time.shape))


def drawn_route(rng: np.random.Generator, duration: float, *, moving: bool = True) -> Route:
    """A route: of ten minutes, 10 turns of 20 to 120 deg at up to 2 m/s^2, up to 3 stops, and speeds of 5 to 20 m/s.

    A shorter one has as many fewer. ``moving`` False: it begins at rest.
    """
    share = duration / 600.0
    wanted: dict[Kind, int] = {
        "turn": round(10 * share),
        "stop": round(rng.integers(1, 4) * share),
        "speed": round(8 * share),
    }
    kinds = [kind for kind, count in wanted.items() for _ in range(count)]
    rng.shuffle(kinds)
    speed, heading = float(rng.uniform(6.0, 14.0)), float(rng.uniform(-np.pi, np.pi))
    start = speed if moving else 0.0
    plan: list[tuple[Kind, float, float, float]] = []
    if not moving:
        plan.append(("speed", 5.0, *_ramp(rng, speed)))
    for kind in kinds:
        if kind == "turn":
            angle = float(rng.choice([-1.0, 1.0]) * np.radians(rng.uniform(20.0, 120.0)))
            sideways = float(rng.uniform(1.0, 2.0))
            plan.append(("turn", 0.0, max(QUICKEST, STEEPEST * abs(angle) * speed / sideways), angle))
            continue
        target = float(rng.uniform(5.0, 20.0))
        if kind == "stop":
            plan += [("speed", 0.0, *_ramp(rng, -speed)), ("speed", float(rng.uniform(5.0, 15.0)), *_ramp(rng, target))]
        else:
            plan.append(("speed", 0.0, *_ramp(rng, target - speed)))
        speed = target
    return _placed(rng, duration, start, heading, plan)


def _ramp(rng: np.random.Generator, size: float) -> tuple[float, float]:
    """How long a change of the speed takes, at up to 0.6 to 1.8 m/s^2, and its size."""
    return max(QUICKEST, STEEPEST * abs(size) / float(rng.uniform(0.6, 1.8))), size


def _placed(
    rng: np.random.Generator,
    duration: float,
    speed: float,
    heading: float,
    plan: list[tuple[Kind, float, float, float]],
) -> Route:
    """What is left of the time is shared out at random between the changes; where it is too short, the last ones fall away."""
    gaps = rng.dirichlet(np.ones(len(plan) + 1)) if plan else np.ones(1)
    free = max(0.0, duration - sum(wait + length for _, wait, length, _ in plan))
    at, speeds, turns = 0.0, list[Change](), list[Change]()
    for (kind, wait, length, size), gap in zip(plan, gaps, strict=False):
        after_stop = wait > 0.0
        at += wait + (0.0 if after_stop else free * float(gap))
        (turns if kind == "turn" else speeds).append(Change(at, length, size))
        at += length
    return Route(speed, heading, tuple(speeds), tuple(turns))
