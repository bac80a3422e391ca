"""Simulated records of an INS and of what it is compared with, by the exact equations: ``truth: ins``.

Run i draws from its seed, in this order: white noises and drift of the INS, then each reference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from estimfw_inertial.rotation import exponential, logarithm
from numpy.typing import NDArray

from estimfw.config.types import Site
from estimfw.data.draws import Draws
from estimfw.data.memory import refuse_too_large
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError
from estimfw.model.nominal import InitialNominal
from estimfw_ins_errors.route import Leg, Route, Sea, drive, voyage
from estimfw_ins_errors.simulate_config import DriveConfig, SimulationConfig, VoyageConfig
from estimfw_ins_errors.simulate_linear import LinearSimulation
from estimfw_ins_errors.simulated_references import TrueMotion, reference_streams

__all__ = ["INS_COLUMNS", "Simulation", "simulate", "simulate_drive"]

FloatArray = NDArray[np.float64]
INS_COLUMNS = ("latitude", "longitude", "velocity_E", "velocity_N", "heading")
#: Nodes of a way that turns, s apart at most.
NODES = 0.5


@dataclass(frozen=True, slots=True)
class Simulation:
    """A source: ``load`` makes the record anew, the same every time for the same settings.

    ``every`` of the nodes of the route are an interval of the INS.
    """

    cfg: SimulationConfig
    route: Route
    every: int
    latitude: float
    longitude: float

    @property
    def seed(self) -> int:
        return self.cfg.seed

    @property
    def start_values(self) -> dict[str, FloatArray]:
        """Where the vehicle is at the start, for policies."""
        return start_values(self.route, self.latitude, self.longitude)

    def load(self) -> Record:
        """Streams ``ins`` and the references; the truth."""
        made = self._draws([np.random.SeedSequence(self.cfg.seed)], {}).run(0)
        return replace(made, attributes={**made.attributes, "seed": self.cfg.seed})

    def drawn_many(self, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, FloatArray]) -> Draws:
        """Runs of a Monte Carlo; see `estimfw.montecarlo.draw`."""
        return self._draws(seeds, start if self.cfg.draw == "prior" else {})

    def _draws(self, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, FloatArray]) -> Draws:
        from estimfw_ins_errors.platform_ins import moved_ins

        cfg, runs, steps = self.cfg, len(seeds), self.route.time.size - 1
        refuse_too_large(8.0 * 40.0 * runs * steps, f"{runs} runs of {steps} steps", "a shorter `duration`")
        dt = float(self.route.time[1])
        errors = _errors(cfg, runs, start)
        children = [seed.spawn(2) for seed in seeds]
        drift, noise = _drawn(cfg, [child[0] for child in children], steps, dt, errors)
        biases = (errors["gyro_bias"][:, None] + 0.5 * (drift[:, 1:] + drift[:, :-1]) + noise[..., :3],
                  errors["accel_bias"][:, None, :2] + noise[..., 3:])  # fmt: skip
        moved = moved_ins(self._start(errors), self.route.velocity, dt, *biases, cfg.gravity)
        true = _TrueWay(self.route, moved[0, :, 0], moved[0, :, 1])
        references = reference_streams(
            cfg.references, cfg.duration, cfg.interval, true.at, [child[1] for child in children], cfg.noise
        )
        kept = slice(None, None, self.every)
        time, own = self.route.time[kept], moved[:, kept]
        C = own[..., 2:11].reshape(runs, -1, 3, 3)
        ins = Stream("ins", time, _recorded(own, C, self.route.heading[kept]), INS_COLUMNS, "sample", cfg.interval)
        truth = {
            "attitude_error_t": -logarithm(C),
            "velocity_t": self.route.velocity[None, kept],
            "latitude": own[:1, :, 0],
            "longitude": own[:1, :, 1],
            "heading": np.mod(self.route.heading[None, kept], 2.0 * np.pi),
            "gyro_bias_t": errors["gyro_bias"][:, None],
            "accel_bias_t": errors["accel_bias"][:, None],
            "gyro_drift_t": drift[:, kept],
        }
        record = Record({"ins": ins, **references}, attributes={"source": cfg.kind})  # type: ignore[attr-defined]
        return Draws(record, time, truth)

    def _start(self, errors: Mapping[str, FloatArray]) -> FloatArray:
        """States (R, 15) of `estimfw_ins_errors.platform_ins`."""
        phi = errors["attitude"]
        C, runs = exponential(-phi), len(phi)
        V = self.route.velocity[0] + errors["velocity"][:, :2]
        true = np.array([self.latitude, self.longitude])
        place = true + np.concatenate([errors["latitude"], errors["longitude"]], axis=1)
        return np.concatenate([np.tile(true, (runs, 1)), C.reshape(runs, 9), V, place], axis=1)


@dataclass(frozen=True, slots=True)
class _TrueWay:
    """The true motion at any instant."""

    route: Route
    latitude: FloatArray
    longitude: FloatArray

    def at(self, time: FloatArray) -> TrueMotion:
        V, K, rate = self.route.at(time)
        L, lam = (np.interp(time, self.route.time, each) for each in (self.latitude, self.longitude))
        return TrueMotion(V[None], K[None], L[None], lam[None], rate)


def _recorded(own: FloatArray, C: FloatArray, heading: FloatArray) -> FloatArray:
    """Columns (R, K, 5) of the stream: place, velocity, and the heading that the platform shows."""
    forward = np.stack([np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=-1)
    seen = (C @ forward[..., None])[..., 0]
    K = np.mod(np.arctan2(seen[..., 0], seen[..., 1]), 2.0 * np.pi)
    return np.concatenate([own[..., 13:15], own[..., 11:13], K[..., None]], axis=-1)


def _errors(cfg: SimulationConfig, runs: int, start: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Errors at the start by quantity (R, axes): as drawn where they were, else as set."""
    set_ = cfg.errors
    as_set = {
        "attitude": set_.attitude, "velocity": set_.velocity, "latitude": (set_.latitude,), "longitude": (set_.longitude,),
        "gyro_bias": set_.gyro_bias, "accel_bias": set_.accel_bias, "gyro_drift": set_.gyro_drift.start,
    }  # fmt: skip
    return {name: start[name] if name in start else np.tile(np.array(x), (runs, 1)) for name, x in as_set.items()}


def _drawn(
    cfg: SimulationConfig,
    seeds: Sequence[np.random.SeedSequence],
    steps: int,
    dt: float,
    errors: Mapping[str, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """The varying drift (R, N + 1, 3) rad/s at the nodes, and the white noises of gyros and accelerometers (R, N, 5)."""
    normal = np.stack([np.random.default_rng(seed).standard_normal((steps, 8)) for seed in seeds]) * float(cfg.noise)
    sigma, tau = cfg.errors.gyro_drift.steady_sigma, cfg.errors.gyro_drift.correlation_time
    keep = np.exp(-dt / tau)
    push = sigma * np.sqrt(-np.expm1(-2.0 * dt / tau)) * normal[..., 5:]
    drift = np.empty((len(seeds), steps + 1, 3))
    drift[:, 0] = errors["gyro_drift"]
    for k in range(steps):
        drift[:, k + 1] = keep * drift[:, k] + push[:, k]
    level = np.array([cfg.errors.gyro_noise] * 3 + [cfg.errors.accel_noise] * 2) / np.sqrt(dt)
    return drift, level * normal[..., :5]


def start_values(route: Route, latitude: float, longitude: float) -> dict[str, FloatArray]:
    """The nominal at the start, without errors."""
    place = {"latitude": np.array(latitude), "longitude": np.array(longitude)}
    return {**place, "velocity_t": route.velocity[0], "heading": np.mod(route.heading[0], 2.0 * np.pi)}


def simulate(cfg: VoyageConfig, site: Site | None, initial: InitialNominal | None) -> Simulation | LinearSimulation:
    """A voyage from the site."""
    del initial
    even = not cfg.legs and cfg.sea is None
    time, every = _nodes(cfg, even)
    legs, course, speed = [Leg(0.0, cfg.course, cfg.speed)], cfg.course, cfg.speed
    for leg in cfg.legs:
        course, speed = leg.course if leg.course is not None else course, leg.speed if leg.speed is not None else speed
        legs.append(Leg(leg.time, course, speed))
    sea = Sea(cfg.sea.surge, cfg.sea.yaw, cfg.sea.period) if cfg.sea is not None else None
    return _source(cfg, voyage(time, legs, cfg.turn_rate, cfg.acceleration, sea), every, site)


def simulate_drive(
    cfg: DriveConfig, site: Site | None, initial: InitialNominal | None
) -> Simulation | LinearSimulation:
    """A drive from the site."""
    del initial
    time, every = _nodes(cfg, even=False)
    rng = np.random.default_rng(cfg.route_seed)
    route = drive(time, rng, cfg.course, cfg.speed, cfg.stretch, cfg.stop, cfg.turn_rate, cfg.acceleration)
    return _source(cfg, route, every, site)


def _nodes(cfg: SimulationConfig, even: bool) -> tuple[FloatArray, int]:
    """Instants of the nodes, and how many make an interval of the INS."""
    every = 1 if even else max(1, int(np.ceil(cfg.interval / NODES - 1e-9)))
    count = int(cfg.duration / cfg.interval + 1e-9) * every
    refuse_too_large(8.0 * 40.0 * count, f"{count} steps of an INS", "a shorter `duration`, or a longer `interval`")
    return cfg.interval / every * np.arange(count + 1, dtype=np.float64), every


def _source(cfg: SimulationConfig, route: Route, every: int, site: Site | None) -> Simulation | LinearSimulation:
    if site is None:
        raise ConfigError(
            "a simulated INS needs a place to start from", hint="add `site: {latitude: 45 deg, longitude: 15 deg}`"
        )
    if cfg.truth == "linear":
        return LinearSimulation(cfg, route, every, site.latitude, site.longitude)
    return Simulation(cfg, route, every, site.latitude, site.longitude)
