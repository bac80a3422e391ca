"""A drive with stops and turns, its IMU, and its odometer (README, Simulation): ``sins_odometer.simulate``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from estimfw_inertial.imu_errors import ImuErrors, RealisedErrors, SensorErrors, apply
from estimfw_inertial.imu_errors_config import ImuErrorsConfig, imu_errors
from estimfw_inertial.increments import IMU_COLUMNS
from estimfw_inertial.place import SAY_THE_SITE
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import (
    Settings,
    Site,
    non_negative_quantity,
    positive_quantity,
    quantity_vector,
)
from estimfw.data.draws import Draws
from estimfw.data.memory import refuse_too_large
from estimfw.data.record import Record, Stream, Truth
from estimfw.errors import ConfigError
from estimfw.model.nominal import InitialNominal
from estimfw_sins_odometer.motion import Motion, Violations, moved
from estimfw_sins_odometer.odometer import Odometer, counted_pulses
from estimfw_sins_odometer.route import drawn_route
from estimfw_sins_odometer.samples import SPEED

__all__ = ["SimulateConfig", "Simulation", "simulate"]

FloatArray = NDArray[np.float64]
DEGREE = np.pi / 180.0
MICRO_G = 9.80665e-6
_Three = tuple[float, float, float]


class OdometerConfig(Settings):
    """Errors of the odometer."""

    pulse: Annotated[float, positive_quantity("m"), Field(description="way of one pulse")] = 0.04
    scale_sigma: Annotated[float, non_negative_quantity("1"), Field(description="of the way, drawn for each drive")] = (
        2e-3
    )
    vibration: Annotated[float, non_negative_quantity("m/s"), Field(description="at 8 Hz, amplitude at 15 m/s")] = 0.25
    slips: Annotated[float, non_negative_quantity("Hz"), Field(description="bursts of slip a second")] = 1.0 / 60.0
    whole: Annotated[bool, Field(description="false: parts of a pulse are counted too")] = True


class ViolationsConfig(Settings):
    """How the vehicle moves other than forward."""

    slip: Annotated[
        float, non_negative_quantity("s"), Field(description="sideways speed / (speed x rate of heading)")
    ] = 0.01
    mounting: Annotated[
        float, non_negative_quantity("rad"), Field(description="one sigma of the direction of travel against forward")
    ] = 0.05 * DEGREE
    oscillation: Annotated[
        float, non_negative_quantity("m/s"), Field(description="sideways and upwards, amplitude at 15 m/s")
    ] = 0.02


class SimulateConfig(Settings):
    """A drive. The streams are ``imu`` (increments) and ``odometer`` (pulses).

    ``errors: false`` makes perfect sensors in a vehicle that moves forward only. ``speed`` puts a column ``speed`` beside the
    increments: the exact one, or the raw one, pulses of the interval over its length.
    """

    kind: Literal["sins_odometer.simulate"]
    duration: Annotated[float, positive_quantity("s"), Field(description="length of the drive")] = 604.0
    rate: Annotated[float, positive_quantity("Hz"), Field(description="of the IMU")] = 100.0
    odometer_rate: Annotated[float, positive_quantity("Hz"), Field(description="of the counter")] = 100.0
    seed: Annotated[int, Field(description="of the route, and of everything else")] = 1
    start: Annotated[Literal["moving", "rest"], Field(description="how the drive begins")] = "moving"
    errors: Annotated[bool, Field(description="false: perfect sensors, no slip, no violations")] = True
    imu: Annotated[ImuErrorsConfig | None, Field(description="errors of the IMU by grade or figure")] = None
    odometer: Annotated[OdometerConfig, Field(description="errors of the odometer")] = OdometerConfig()
    violations: Annotated[ViolationsConfig, Field(description="motion other than forward")] = ViolationsConfig()
    lever_arm: Annotated[_Three, quantity_vector("m", 3), Field(description="from the IMU to the odometer, in b")] = (
        0.0,
    ) * 3
    speed: Annotated[Literal["none", "exact", "raw"], Field(description="column `speed` beside the increments")] = (
        "none"
    )


#: Gyros of 0.015 deg/h and 0.003 deg/sqrt(h), accelerometers of 75 ug and 20 ug/sqrt(Hz); a third of the bias varies.
_IMU = ImuErrors(
    SensorErrors(bias=0.015 * DEGREE / 3600.0, bias_sigma=0.005 * DEGREE / 3600.0, random_walk=0.003 * DEGREE / 60.0),
    SensorErrors(bias=75.0 * MICRO_G, bias_sigma=25.0 * MICRO_G, random_walk=20.0 * MICRO_G),
)


@dataclass(frozen=True, slots=True)
class Simulation:
    """A source: ``load`` makes the record anew, the same every time for the same settings."""

    cfg: SimulateConfig
    site: Site

    @property
    def seed(self) -> int:
        return self.cfg.seed

    def load(self) -> Record:
        """Streams ``imu`` and ``odometer``, and the truth."""
        return self._record(np.random.SeedSequence(self.cfg.seed))

    def drawn_many(self, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, FloatArray]) -> Draws:
        """Runs of a Monte Carlo: each is a drive of its own, on another route, with other errors."""
        del start
        return Draws.of([self._record(seed) for seed in seeds])

    def _record(self, seed: np.random.SeedSequence) -> Record:
        cfg = self.cfg
        of_route, of_motion, of_imu, of_odometer = (np.random.default_rng(s) for s in seed.spawn(4))
        time = self._instants(cfg.rate)
        route = drawn_route(of_route, cfg.duration, moving=cfg.start == "moving")
        place = (self.site.latitude, self.site.longitude, self.site.height)
        motion = moved(route, time, place, self._violations(), np.array(cfg.lever_arm), of_motion)
        measured, realised = apply(motion.increments, 1.0 / cfg.rate, of_imu, self._imu())
        pulses = counted_pulses(time, motion.speed, self._odometer(), of_odometer)
        imu = Stream("imu", time[1:], measured, IMU_COLUMNS, "increment", 1.0 / cfg.rate)
        streams = {"imu": self._with_speed(imu, motion, pulses), "odometer": self._counter(time, pulses)}
        attributes = {"source": cfg.kind, "seed": cfg.seed}
        return Record(streams, truth=Truth(time[1:], _truth(motion, realised)), attributes=attributes)

    def _instants(self, rate: float) -> FloatArray:
        count = round(self.cfg.duration * rate)
        if count < 4:
            raise ConfigError(f"source: {self.cfg.duration:g} s at {rate:g} Hz is no drive")
        refuse_too_large(
            8.0 * 400.0 * count, f"{count:.3g} samples of an IMU", "a shorter `duration` or a lower `rate`"
        )
        return np.arange(count + 1, dtype=np.float64) / rate

    def _with_speed(self, imu: Stream, motion: Motion, pulses: FloatArray) -> Stream:
        if self.cfg.speed == "none":
            return imu
        raw = self.cfg.odometer.pulse * self.cfg.rate * np.diff(pulses)
        speed = motion.speed[1:] if self.cfg.speed == "exact" else raw
        return replace(imu, values=np.concatenate([imu.values, speed[:, None]], axis=1), columns=(*imu.columns, SPEED))

    def _counter(self, time: FloatArray, pulses: FloatArray) -> Stream:
        rate = self.cfg.odometer_rate
        at = self._instants(rate)
        seen = pulses[np.minimum(np.searchsorted(time, at - 1e-9), time.size - 1)]
        return Stream("odometer", at, seen[:, None], ("pulses",), "sample", 1.0 / rate)

    def _violations(self) -> Violations:
        v = self.cfg.violations
        return Violations(v.slip, v.mounting, v.oscillation) if self.cfg.errors else Violations(0.0, 0.0, 0.0)

    def _odometer(self) -> Odometer:
        o = self.cfg.odometer
        if not self.cfg.errors:
            return Odometer(o.pulse, 0.0, 0.0, 0.0, whole=False)
        return Odometer(o.pulse, o.scale_sigma, o.vibration, o.slips, o.whole)

    def _imu(self) -> ImuErrors:
        if not self.cfg.errors:
            return ImuErrors()
        return imu_errors(self.cfg.imu) if self.cfg.imu is not None else _IMU


def _truth(motion: Motion, realised: RealisedErrors) -> dict[str, FloatArray]:
    """At the rows of the IMU."""
    return {
        "C_bn": motion.C_bn[1:],
        "velocity_n": motion.velocity_n[1:],
        "position": motion.position[1:],
        "track": motion.track[1:],
        "speed": motion.speed[1:],
        "accel_bias_b": realised.accel.bias,
        "gyro_bias_b": realised.gyro.bias,
    }


def simulate(cfg: SimulateConfig, site: Site | None, initial: InitialNominal | None) -> Simulation:
    """The source; it needs a site. Where the vehicle heads is drawn, the start of the filter is found from the record."""
    del initial
    if site is None:
        raise ConfigError("source sins_odometer.simulate needs a site", hint=SAY_THE_SITE)
    return Simulation(cfg, site)
