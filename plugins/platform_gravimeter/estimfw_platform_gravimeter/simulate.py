"""Simulation of the alignment: the exact platform, its sensors, and the velocity that it computes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from estimfw_inertial.rotation import exponential
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
from estimfw.data.record import SAME, Record, Stream
from estimfw.errors import ConfigError
from estimfw.model.nominal import InitialNominal
from estimfw.plan.over_time import RowsOverTime
from estimfw.plan.plan import Plan

__all__ = ["SimulateConfig", "Simulation", "simulate"]

FloatArray = NDArray[np.float64]
_Two = tuple[float, float]
_Three = tuple[float, float, float]

ARCMIN = np.pi / 10800.0
DEGREE_PER_HOUR = np.pi / 180.0 / 3600.0
MICRO_G = 9.80665e-6
#: s: the errors of the sensors are constant over a step of the simulation.
LONGEST_STEP = 1.0
#: Setting, and the quantity of the block that the filter has for it.
DRAWN = {
    "velocity_error": "velocity", "attitude_error": "attitude", "accel_bias": "accel_bias", "gyro_drift": "gyro_drift",
}  # fmt: skip


class SimulateConfig(Settings):
    """The platform stands as the nominal says, but for its errors; their defaults are those of the paper's scenario.

    ``noise: false`` switches all white noises off. In a Monte Carlo each run draws, besides its noises, its errors from the
    filter's prior (``draw: prior``), or has those that are set here (``draw: noise``).
    """

    kind: Literal["platform_gravimeter.simulate"]
    duration: Annotated[float, positive_quantity("s"), Field(description="length of the record")] = 1200.0
    rate: Annotated[float, positive_quantity("Hz"), Field(description="of the velocity readings")] = 1.0
    velocity_error: Annotated[_Two, quantity_vector("m/s", 2), Field(description="at the start (E, N)")] = (0.0,) * 2
    attitude_error: Annotated[
        _Three, quantity_vector("rad", 3), Field(description="phi at the start (E, N, U), a rotation vector")
    ] = (6.0 * ARCMIN, -6.0 * ARCMIN, 30.0 * ARCMIN)
    accel_bias: Annotated[_Two, quantity_vector("m/s^2", 2), Field(description="of the accelerometers x, y")] = (
        50.0 * MICRO_G,
        -50.0 * MICRO_G,
    )
    gyro_drift: Annotated[_Three, quantity_vector("rad/s", 3), Field(description="of the gyros x, y, z")] = (
        0.01 * DEGREE_PER_HOUR,
        0.02 * DEGREE_PER_HOUR,
        -0.01 * DEGREE_PER_HOUR,
    )
    gyro_noise: Annotated[
        float,
        non_negative_quantity("rad/sqrt(s)", examples=("0.001 deg/sqrt(h)",)),
        Field(description="angle random walk of each gyro"),
    ] = 0.001 * np.pi / 180.0 / 60.0
    accel_noise: Annotated[
        float,
        non_negative_quantity("m/s/sqrt(s)", examples=("5 ug/sqrt(Hz)",)),
        Field(description="velocity random walk of each accelerometer"),
    ] = 5.0 * MICRO_G
    velocity_noise: Annotated[
        float, non_negative_quantity("m/s"), Field(description="of each reading of the computed velocity")
    ] = 0.01
    noise: Annotated[bool, Field(description="false: no white noises; biases and drifts stay")] = True
    seed: Annotated[int, Field(ge=0, description="of the noises")] = 1
    draw: Annotated[
        Literal["prior", "noise"],
        Field(description="of the runs of a Monte Carlo: errors from the filter's prior, or noises alone"),
    ] = "prior"


@dataclass(frozen=True, slots=True)
class Simulation:
    """A source: the stream ``velocity`` (E, N), and the truth. How the platform is turned it takes from the filter's nominal."""

    cfg: SimulateConfig
    schedule: RowsOverTime | None = None

    @property
    def made_with(self) -> tuple[str, ...]:
        """Sections of the config that the record depends on, besides its own: filters with others do not share it."""
        return ("nominal",)

    @property
    def seed(self) -> int:
        return self.cfg.seed

    def along(self, schedule: RowsOverTime) -> Simulation:
        """The same, of a platform that is turned at some instants."""
        return replace(self, schedule=schedule)

    def load_for(self, plan: Plan, row: FloatArray) -> Record:
        """The record of ``seed``, for the plan's nominal; see `drawn_many_for`."""
        seeds = [np.random.SeedSequence(self.cfg.seed)]
        made = self._draws(plan, row, seeds, {name: np.array([getattr(self.cfg, name)]) for name in DRAWN}).run(0)
        return replace(made, attributes={**made.attributes, "seed": self.cfg.seed})

    def drawn_many_for(
        self, plan: Plan, row: FloatArray, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, FloatArray]
    ) -> Draws:
        """Runs of a Monte Carlo; see `estimfw.montecarlo.draw`.

        Raises
        ------
        ConfigError
            The nominal is not that of a platform.
        """
        errors = {}
        for name, quantity in DRAWN.items():
            as_set = np.tile(np.array(getattr(self.cfg, name)), (len(seeds), 1))
            drawn = self.cfg.draw == "prior" and quantity in start
            errors[name] = np.asarray(start[quantity])[:, : as_set.shape[1]] if drawn else as_set
        return self._draws(plan, row, seeds, errors)

    def _draws(
        self,
        plan: Plan,
        row: FloatArray,
        seeds: Sequence[np.random.SeedSequence],
        errors: Mapping[str, FloatArray],
    ) -> Draws:
        readings, edges = self._times()
        children = [seed.spawn(2) for seed in seeds]
        of_sensors, of_readings = ([np.random.default_rng(two[k]) for two in children] for k in range(2))
        platform = _platform(plan, self._rows(row, edges))
        x = self._motion(np.diff(edges), platform, errors, of_sensors)
        at = np.searchsorted(edges[1:], readings - SAME)
        noise = np.stack([rng.standard_normal((readings.size, 2)) for rng in of_readings]) * float(self.cfg.noise)
        values = x[:, at, :2] + self.cfg.velocity_noise * noise
        stream = Stream("velocity", readings, values, ("E", "N"), "sample", 1.0 / self.cfg.rate)
        attributes = {"source": "platform_gravimeter.simulate"}
        record = Record({"velocity": stream}, initial={"time": np.zeros(len(seeds))}, attributes=attributes)
        return Draws(record, edges[1:], _truth(x, platform, errors))

    def _times(self) -> tuple[FloatArray, FloatArray]:
        """Instants of the readings (N,), and edges of the steps of the simulation (K + 1,), from 0 s."""
        cfg = self.cfg
        count = int(cfg.duration * cfg.rate + 1e-9)
        if count < 1:
            raise ConfigError(f"source: {cfg.duration:g} s at {cfg.rate:g} Hz is not even one reading")
        refuse_too_large(
            8.0 * 60.0 * count * max(1.0, 1.0 / (cfg.rate * LONGEST_STEP)),
            f"{count:.3g} readings",
            "a shorter `duration` or a lower `rate`",
        )
        readings = np.arange(1, count + 1) / cfg.rate
        turns = [t for t in (self.schedule.instants if self.schedule else ()) if 0.0 < t < readings[-1]]
        ends = np.unique(np.concatenate([readings, turns]))
        ends = ends[np.concatenate([[True], np.diff(ends) > SAME])]
        pieces = [
            np.linspace(begin, end, max(1, int(np.ceil((end - begin) / LONGEST_STEP - 1e-9))) + 1)[1:]
            for begin, end in zip(np.concatenate([[0.0], ends[:-1]]), ends, strict=True)
        ]
        return readings, np.concatenate([[0.0], *pieces])

    def _rows(self, row: FloatArray, edges: FloatArray) -> FloatArray:
        """The nominal (K, size) in each step."""
        if self.schedule is None:
            return np.broadcast_to(row, (edges.size - 1, row.size))
        return self.schedule.between(edges[:-1], edges[1:])[0]

    def _motion(
        self,
        lengths: FloatArray,
        platform: StandingPlatform,
        errors: Mapping[str, FloatArray],
        generators: Sequence[np.random.Generator],
    ) -> FloatArray:
        """Computed velocity and phi (R, K, 5) at the ends of the steps."""
        from estimfw_platform_gravimeter.exact import motion  # here, for numba takes a second to load

        normal = float(self.cfg.noise) * np.stack([rng.standard_normal((lengths.size, 5)) for rng in generators])
        density = np.repeat([self.cfg.accel_noise, self.cfg.gyro_noise], [2, 3])
        constant = np.concatenate([errors["accel_bias"], errors["gyro_drift"]], axis=1)
        sensors = constant[:, None] + density / np.sqrt(lengths)[:, None] * normal  # white noise: its mean over a step
        start = np.concatenate([errors["velocity_error"], errors["attitude_error"]], axis=1)
        out = np.empty((len(generators), lengths.size, 5))
        motion(start, sensors, platform.C_pn, platform.earth_rate_n, platform.place, lengths, out)
        return out


@dataclass(frozen=True, slots=True)
class StandingPlatform:
    """The nominal in K steps: C_pn (K, 3, 3), the Earth's rate (K, 3) rad/s in n; g (m/s^2), 1 / R (1/m) and tan L, (K, 3)."""

    C_pn: FloatArray
    earth_rate_n: FloatArray
    place: FloatArray


def _platform(plan: Plan, rows: FloatArray) -> StandingPlatform:
    nominal = plan.layout.unpack(rows)
    if "C_pn" not in nominal:
        raise ConfigError(
            "source platform_gravimeter.simulate does not know how the platform stands",
            hint="the config needs `nominal: {kind: platform_gravimeter.platform, alpha: 30 deg}`",
        )
    place = np.stack([nominal[name] for name in ("gravity", "curvature", "tan_latitude")], axis=-1)
    return StandingPlatform(*(np.ascontiguousarray(a) for a in (nominal["C_pn"], nominal["earth_rate_n"], place)))


def _truth(x: FloatArray, platform: StandingPlatform, errors: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Of runs, at the ends of the steps; what has no vertical part gets a zero there."""
    return {
        "velocity_error_n": _with_zero(x[..., :2]),
        "attitude_error_n": x[..., 2:],
        "accel_bias_p": _with_zero(errors["accel_bias"])[:, None],
        "gyro_drift_p": errors["gyro_drift"][:, None],
        "C_pn": exponential(x[..., 2:]) @ platform.C_pn,
    }


def _with_zero(level: FloatArray) -> FloatArray:
    return np.concatenate([level, np.zeros((*level.shape[:-1], 1))], axis=-1)


def simulate(cfg: SimulateConfig, site: Site | None, initial: InitialNominal | None) -> Simulation:
    """The source; the place and the platform are those of the filter's nominal."""
    return Simulation(cfg)
