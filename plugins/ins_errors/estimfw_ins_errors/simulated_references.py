"""What a simulated vehicle carries besides its INS: GNSS, Doppler log, compass, with noise, lever arms and outages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Strict, model_validator

from estimfw.config.quantity_types import refuse
from estimfw.config.types import Settings, non_negative_quantity, positive_quantity, quantity, quantity_vector
from estimfw.data.record import Stream
from estimfw_ins_errors.local_terms import meridian_curvature, prime_vertical_curvature
from estimfw_ins_errors.references import lever_arm, vehicle_velocity

__all__ = ["ReferencesConfig", "TrueMotion", "reference_streams"]

FloatArray = NDArray[np.float64]
_Two = tuple[float, float]
ARCMIN = np.pi / 180.0 / 60.0
_ARM = "right and forward, from the INS to the reference"
_Outage = Annotated[tuple[Annotated[float, quantity("s")], Annotated[float, quantity("s")]], Strict(False)]


class _ReferenceConfig(Settings):
    """When it reads."""

    every: Annotated[
        Annotated[float, positive_quantity("s")] | None,
        Field(description="interval of readings; left out: that of the INS"),
    ] = None
    outages: Annotated[
        tuple[_Outage, ...], Strict(False), Field(description="pairs [from, to] between which there are no readings")
    ] = ()

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for i, (begin, end) in enumerate(self.outages):
            if end <= begin:
                refuse(f"the outage ends at {end:g} s, before it begins", "[from, to]", ("outages", i))
        return self


class SpeedReferenceConfig(_ReferenceConfig):
    """A velocity."""

    noise: Annotated[float, non_negative_quantity("m/s"), Field(description="of each component, one sigma")] = 0.05
    lever_arm: Annotated[_Two, quantity_vector("m", 2), Field(description=_ARM)] = (0.0, 0.0)


class HeadingReferenceConfig(_ReferenceConfig):
    """A heading."""

    noise: Annotated[float, non_negative_quantity("rad"), Field(description="one sigma")] = 6.0 * ARCMIN


class PositionReferenceConfig(_ReferenceConfig):
    """Latitude and longitude."""

    noise: Annotated[
        float, non_negative_quantity("m"), Field(description="to the north and to the east, one sigma")
    ] = 5.0
    lever_arm: Annotated[_Two, quantity_vector("m", 2), Field(description=_ARM)] = (0.0, 0.0)


class ReferencesConfig(Settings):
    """Each makes the stream of its name; null: there is none."""

    velocity: Annotated[SpeedReferenceConfig | None, Field(description="GNSS: columns E, N")] = SpeedReferenceConfig()
    heading: Annotated[HeadingReferenceConfig | None, Field(description="compass: column heading")] = (
        HeadingReferenceConfig()
    )
    doppler_log: Annotated[SpeedReferenceConfig | None, Field(description="columns right, forward")] = None
    position: Annotated[PositionReferenceConfig | None, Field(description="GNSS: columns latitude, longitude")] = None


@dataclass(frozen=True, slots=True)
class TrueMotion:
    """Of R runs (or 1 for all) at K instants: velocity (R, K, 2) m/s, heading, latitude, longitude (R, K) rad, and heading rate
    (K,) rad/s."""

    velocity: FloatArray
    heading: FloatArray
    latitude: FloatArray
    longitude: FloatArray
    heading_rate: FloatArray


def reference_streams(
    cfg: ReferencesConfig,
    duration: float,
    interval: float,
    motion: Callable[[FloatArray], TrueMotion],
    seeds: Sequence[np.random.SeedSequence],
    noise: bool,
) -> dict[str, Stream]:
    """The streams of R runs, values (R, K, columns).

    Parameters
    ----------
    cfg : ReferencesConfig
    duration, interval : float, s
        Of the record, and of its INS.
    motion : callable
        The true motion at instants (K,).
    seeds : sequence of R SeedSequence
        Each with a child for each reference, in the order of ``cfg``.
    noise : bool
    """
    children = [seed.spawn(len(_READ)) for seed in seeds]
    made: dict[str, Stream] = {}
    for i, (name, (columns, read)) in enumerate(_READ.items()):
        own = getattr(cfg, name)
        if own is None:
            continue
        every = own.every or interval
        time = every * np.arange(1, int(duration / every + 1e-9) + 1, dtype=np.float64)
        generators = [np.random.default_rng(child[i]) for child in children]
        normal = np.stack([rng.standard_normal((time.size, len(columns))) for rng in generators]) * float(noise)
        values = np.broadcast_to(read(own, motion(time), normal), normal.shape)
        there = np.ones(time.size, dtype=bool)
        for begin, end in own.outages:
            there &= (time < begin) | (time >= end)
        made[name] = Stream(name, time[there], values[:, there], columns, "sample", every)
    return made


def _velocity(cfg: SpeedReferenceConfig, true: TrueMotion, normal: FloatArray) -> FloatArray:
    arm = lever_arm(true.heading, np.array(cfg.lever_arm))
    swing = true.heading_rate[:, None] * np.stack([arm[..., 1], -arm[..., 0]], axis=-1)
    return true.velocity + swing + cfg.noise * normal


def _doppler_log(cfg: SpeedReferenceConfig, true: TrueMotion, normal: FloatArray) -> FloatArray:
    right, forward = cfg.lever_arm
    swing = true.heading_rate[:, None] * np.array([forward, -right])
    return np.asarray(vehicle_velocity(true.heading, true.velocity) + swing + cfg.noise * normal)


def _heading(cfg: HeadingReferenceConfig, true: TrueMotion, normal: FloatArray) -> FloatArray:
    return np.asarray(np.mod(true.heading[..., None] + cfg.noise * normal, 2.0 * np.pi))


def _position(cfg: PositionReferenceConfig, true: TrueMotion, normal: FloatArray) -> FloatArray:
    moved = lever_arm(true.heading, np.array(cfg.lever_arm)) + cfg.noise * normal
    L = true.latitude
    east = moved[..., 0] * prime_vertical_curvature(L) / np.cos(L)
    return np.stack(np.broadcast_arrays(L + moved[..., 1] * meridian_curvature(L), true.longitude + east), axis=-1)


_READ: Mapping[str, tuple[tuple[str, ...], Callable[..., FloatArray]]] = {
    "velocity": (("E", "N"), _velocity),
    "heading": (("heading",), _heading),
    "doppler_log": (("right", "forward"), _doppler_log),
    "position": (("latitude", "longitude"), _position),
}
