"""Settings of the simulated voyages and drives; the defaults are the canonical scenario."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, Strict, model_validator

from estimfw.config.quantity_types import refuse
from estimfw.config.types import (
    Settings,
    non_negative_quantity,
    positive_quantity,
    quantity,
    quantity_vector,
)
from estimfw_ins_errors.simulated_references import ReferencesConfig

__all__ = [
    "DriveConfig",
    "ErrorsConfig",
    "GyroDriftConfig",
    "LegConfig",
    "SeaConfig",
    "SimulationConfig",
    "VoyageConfig",
]

_Two = tuple[float, float]
_Three = tuple[float, float, float]
DEGREE = np.pi / 180.0
KNOT = 1852.0 / 3600.0
MICRO_G = 9.80665e-6


class GyroDriftConfig(Settings):
    """A first-order Gauss-Markov drift of each gyro, besides the constant one."""

    start: Annotated[_Three, quantity_vector("rad/s", 3), Field(description="at the start, about E, N, U")] = (0.0,) * 3
    steady_sigma: Annotated[float, non_negative_quantity("rad/s"), Field(description="in the long run")] = 0.0
    correlation_time: Annotated[float, positive_quantity("s"), Field(description="tau")] = 3600.0


class ErrorsConfig(Settings):
    """Of the INS; those at the start hold for a single run, in a Monte Carlo they are drawn from the prior of the filter."""

    attitude: Annotated[
        _Three, quantity_vector("rad", 3), Field(description="alpha, beta, gamma at the start, about E, N, U")
    ] = (2.0 * DEGREE / 60.0, 2.0 * DEGREE / 60.0, 6.0 * DEGREE / 60.0)
    velocity: Annotated[_Two, quantity_vector("m/s", 2), Field(description="at the start, E and N")] = (0.0, 0.0)
    latitude: Annotated[float, quantity("rad"), Field(description="at the start")] = 0.0
    longitude: Annotated[float, quantity("rad"), Field(description="at the start")] = 0.0
    gyro_bias: Annotated[_Three, quantity_vector("rad/s", 3), Field(description="constant, about E, N, U")] = (
        0.1 * DEGREE / 3600.0,
    ) * 3
    accel_bias: Annotated[_Two, quantity_vector("m/s^2", 2), Field(description="constant, along E and N")] = (
        100.0 * MICRO_G,
    ) * 2
    gyro_drift: Annotated[GyroDriftConfig, Field(description="varying part of the drifts")] = GyroDriftConfig()
    gyro_noise: Annotated[
        float,
        non_negative_quantity("rad/sqrt(s)", examples=("0.001 deg/sqrt(h)",)),
        Field(description="angle random walk"),
    ] = 0.001 * DEGREE / 60.0
    accel_noise: Annotated[
        float,
        non_negative_quantity("m/s/sqrt(s)", examples=("10 ug/sqrt(Hz)",)),
        Field(description="velocity random walk"),
    ] = 10.0 * MICRO_G


class SimulationConfig(Settings):
    """What a voyage and a drive have in common.

    ``truth: ins`` integrates the exact platform equations: the vehicle goes its way, and an INS with these errors records it.
    ``truth: linear`` takes the way for what the INS recorded, and its errors from the filter's own model (before policies)
    along it: true is recorded minus error. ``noise: false``: no white noise and no varying drift, errors at the start stay.
    """

    duration: Annotated[float, positive_quantity("s"), Field(description="length of the record")] = 14400.0
    interval: Annotated[float, positive_quantity("s"), Field(description="of the rows of the INS")] = 10.0
    truth: Annotated[Literal["ins", "linear"], Field(description="an exact INS, or the filter's own linear model")] = (
        "ins"
    )
    noise: Annotated[bool, Field(description="false: no white noise, no varying drift")] = True
    seed: Annotated[int, Strict(), Field(ge=0, description="of all random numbers")] = 1
    gravity: Annotated[float, positive_quantity("m/s^2"), Field(description="constant")] = 9.80665
    errors: Annotated[ErrorsConfig, Field(description="of the INS")] = ErrorsConfig()
    references: Annotated[ReferencesConfig, Field(description="what else there is to compare with")] = (
        ReferencesConfig()
    )
    draw: Annotated[
        Literal["prior", "noise"],
        Field(description="of the runs of a Monte Carlo: errors at the start from the filter's prior, or noises alone"),
    ] = "prior"

    @model_validator(mode="after")
    def _several(self) -> Self:
        if self.duration < self.interval:
            refuse(f"{self.duration:g} s are not even one interval of {self.interval:g} s", None, "duration")
        return self


class LegConfig(Settings):
    """From an instant on another course, another speed, or both."""

    time: Annotated[float, positive_quantity("s"), Field(description="since the start")]
    course: Annotated[Annotated[float, quantity("rad")] | None, Field(description="left out: as before")] = None
    speed: Annotated[
        Annotated[float, non_negative_quantity("m/s")] | None, Field(description="left out: as before")
    ] = None


class SeaConfig(Settings):
    """Sinusoidal motion in a seaway."""

    surge: Annotated[float, non_negative_quantity("m/s"), Field(description="amplitude along the course")] = 0.3
    yaw: Annotated[float, non_negative_quantity("rad"), Field(description="amplitude of the heading")] = 2.0 * DEGREE
    period: Annotated[float, positive_quantity("s"), Field(description="of both")] = 9.0


class VoyageConfig(SimulationConfig):
    """A ship with an INS: by default 4 h at 20 kn on a course of 45 deg from the site, the canonical scenario."""

    kind: Literal["ins_errors.simulate"]
    speed: Annotated[float, non_negative_quantity("m/s", examples=("20 kn",)), Field(description="at the start")] = (
        20.0 * KNOT
    )
    course: Annotated[float, quantity("rad"), Field(description="at the start, clockwise from north")] = 45.0 * DEGREE
    legs: Annotated[tuple[LegConfig, ...], Strict(False), Field(description="changes of course and speed")] = ()
    turn_rate: Annotated[float, positive_quantity("rad/s"), Field(description="of a change of course")] = 0.5 * DEGREE
    acceleration: Annotated[float, positive_quantity("m/s^2"), Field(description="of a change of speed")] = 0.02
    sea: Annotated[SeaConfig | None, Field(description="left out: a smooth sea")] = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        for i in range(1, len(self.legs)):
            if self.legs[i].time <= self.legs[i - 1].time:
                refuse("the legs are not in the order of time", None, ("legs", i, "time"))
        return self


class DriveConfig(SimulationConfig):
    """A car with an INS: stretches, stops and right-angled turns, drawn by ``route_seed``."""

    kind: Literal["ins_errors.simulate_drive"]
    interval: Annotated[float, positive_quantity("s"), Field(description="of the rows of the INS")] = 1.0
    speed: Annotated[float, positive_quantity("m/s"), Field(description="about, of a stretch")] = 15.0
    course: Annotated[float, quantity("rad"), Field(description="at the start, clockwise from north")] = 45.0 * DEGREE
    stretch: Annotated[float, positive_quantity("s"), Field(description="about, between stops and turns")] = 120.0
    stop: Annotated[float, positive_quantity("s"), Field(description="about, of a stop")] = 30.0
    turn_rate: Annotated[float, positive_quantity("rad/s"), Field(description="of a turn")] = 10.0 * DEGREE
    acceleration: Annotated[float, positive_quantity("m/s^2"), Field(description="of starting and braking")] = 1.5
    route_seed: Annotated[int, Strict(), Field(ge=0, description="of the way; runs of a Monte Carlo share it")] = 1
