"""What the coarse alignments have in common: their settings, and how they hand over the start."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from estimfw.config.types import Settings, non_negative_quantity, positive_quantity
from estimfw.data.record import Event
from estimfw.model.nominal import InitialNominal
from estimfw_inertial.coarse_window import pole_events
from estimfw_inertial.place import Place
from estimfw_inertial.rotation import euler_angles, euler_jacobian
from estimfw_inertial.sensor_grade import SensorGrade
from estimfw_inertial.standing_attitude import StandingAttitude

__all__ = ["CoarseConfig", "identity_start", "start_from"]

_GRADE = SensorGrade()


class CoarseConfig(Settings):
    """How long to align, and the grade of the sensors (one sigma of each axis), which only the covariance needs."""

    duration: Annotated[float, positive_quantity("s"), Field(description="length of the window, from the first sample")]
    gyro_bias: Annotated[
        float,
        non_negative_quantity("rad/s", examples=("0.03 deg/h",)),
        Field(description="one sigma; a block of gyro biases says its own instead (so for accel_bias)"),
    ] = _GRADE.gyro_bias
    accel_bias: Annotated[
        float, non_negative_quantity("m/s^2", examples=("100 ug",)), Field(description="one sigma")
    ] = _GRADE.accel_bias
    angle_random_walk: Annotated[
        float,
        non_negative_quantity("rad/sqrt(s)", examples=("0.001 deg/sqrt(h)",)),
        Field(description="noise of the gyros, a density"),
    ] = _GRADE.angle_random_walk
    velocity_random_walk: Annotated[
        float,
        non_negative_quantity("m/s^1.5", examples=("10 ug/sqrt(Hz)",)),
        Field(description="noise of the accelerometers, a density"),
    ] = _GRADE.velocity_random_walk

    @property
    def grade(self) -> SensorGrade:
        return SensorGrade(self.gyro_bias, self.accel_bias, self.angle_random_walk, self.velocity_random_walk)


def start_from(found: StandingAttitude, source: str, begin: float, place: Place) -> InitialNominal:
    """The start that a filter takes over: attitude, zero velocity, covariance, instant; and an event that tells it.

    Parameters
    ----------
    found : StandingAttitude
    source : str
        How it was found, for people.
    begin : float, s
        Where the window begins.
    place : Place
    """
    return InitialNominal(
        values={"C_bn": found.C_bn, "velocity_n": np.zeros(3)},
        covariance={"attitude": found.covariance},
        shares={"attitude": found.shares},
        time=found.time,
        source=source,
        events=(_start_event(found, source, begin), *pole_events(place)),
    )


def _start_event(found: StandingAttitude, source: str, begin: float) -> Event:
    angles = np.degrees(euler_angles(found.C_bn))
    to_angles = np.degrees(euler_jacobian(found.C_bn))
    sigmas = np.sqrt(np.diag(to_angles @ found.covariance @ to_angles.T))
    told = ", ".join(
        f"{name} {angle:.4f} +- {sigma:.2g} deg"
        for name, angle, sigma in zip(("yaw", "pitch", "roll"), angles, sigmas, strict=True)
    )
    return Event(found.time, "coarse alignment", "start", f"{source}, {begin:g} to {found.time:g} s: {told}")


def identity_start() -> InitialNominal:
    """Stands for the attitude before there are data: level, forward axis to the north."""
    return InitialNominal(values={"C_bn": np.eye(3), "velocity_n": np.zeros(3)}, source="level, facing north")
