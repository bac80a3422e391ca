"""Simulated records whose errors are those of the filter's own model along the way that the INS recorded: ``truth: linear``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.data.draws import Draws
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError
from estimfw.kernels import ud
from estimfw.plan.plan import Plan
from estimfw.spelling import did_you_mean
from estimfw_ins_errors.local_terms import meridian_curvature, prime_vertical_curvature
from estimfw_ins_errors.longitude import longitude_error_rate, trapezoid
from estimfw_ins_errors.recorded_step import CORRECTION, VARIABLES, step
from estimfw_ins_errors.route import Route
from estimfw_ins_errors.simulate_config import SimulationConfig
from estimfw_ins_errors.simulated_references import TrueMotion, reference_streams

__all__ = ["LinearSimulation", "recorded_way"]

FloatArray = NDArray[np.float64]
POINTS = {"start": 0.0, "middle": 0.5, "end": 1.0}
#: The settings of errors at the start, and the block that each is for.
BLOCKS = {
    "attitude": "attitude_error", "velocity": "velocity_error", "latitude": "latitude_error", "longitude": "longitude_error",
    "gyro_bias": "gyro_bias", "accel_bias": "accel_bias", "gyro_drift": "gyro_drift",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class LinearSimulation:
    """x <- Phi x + w along the recorded way; see `estimfw_ins_errors.simulate.Simulation` for the attributes."""

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
        """Where the INS starts, for policies."""
        place = {"latitude": np.array(self.latitude), "longitude": np.array(self.longitude)}
        return {**place, "velocity_t": self.route.velocity[0], "heading": np.mod(self.route.heading[0], 2.0 * np.pi)}

    def load_for(self, plan: Plan, row: FloatArray) -> Record:
        """The record of one run, of ``seed``, with the errors at the start as set; faults as `drawn_many_for`."""
        start = _as_set(self.cfg, plan)[None]
        made = self._draws(plan, row, [np.random.SeedSequence(self.cfg.seed)], start).run(0)
        return replace(made, attributes={**made.attributes, "seed": self.cfg.seed})

    def drawn_many_for(
        self, plan: Plan, row: FloatArray, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, FloatArray]
    ) -> Draws:
        """Runs of a Monte Carlo, each with its start from the prior of the model.

        Parameters
        ----------
        plan : Plan
            Of the model before policies.
        row : (size,) array
            Its nominal at the start.
        seeds : sequence of R SeedSequence
        start : mapping
            Not used: it does not say how states of one quantity share what was drawn.

        Raises
        ------
        ConfigError
            The nominal of the plan is not that of ``ins_errors.recorded``, or it has known inputs.
        """
        del start
        children = [seed.spawn(3) for seed in seeds]
        if self.cfg.draw == "prior":
            mean, covariance = plan.prior.evaluate(plan.layout.unpack(row))
            normal = np.stack([np.random.default_rng(child[2]).standard_normal(len(mean)) for child in children])
            x = mean + normal @ _factors(covariance).T
        else:
            x = np.tile(_as_set(self.cfg, plan), (len(seeds), 1))
        return self._draws(plan, row, seeds, x)

    def _draws(self, plan: Plan, row: FloatArray, seeds: Sequence[np.random.SeedSequence], x: FloatArray) -> Draws:
        if plan.layout.variables != VARIABLES or plan.inputs:
            raise ConfigError(
                "truth: linear simulates models along a recorded INS, without known inputs",
                hint="nominal: {kind: ins_errors.recorded}; truth: ins needs no model",
            )
        gravity = float(plan.layout.unpack(row)["gravity"])
        time, recorded = recorded_way(self.route, self.every, self.latitude, self.longitude)
        children = [seed.spawn(2) for seed in seeds]
        states = self._states(plan, time, recorded, gravity, [c[0] for c in children], x)
        errors = _errors(plan, row, states)
        if not errors.knows_longitude:
            rate = longitude_error_rate(
                recorded[:, 0], recorded[:, 2], errors.velocity[..., 0], errors.latitude
            )  # fmt: skip
            errors = replace(errors, longitude=trapezoid(time, rate))
        true = _true(recorded, errors)
        way = _Way(time, true)
        references = reference_streams(
            self.cfg.references, self.cfg.duration, self.cfg.interval, way.at, [c[1] for c in children], self.cfg.noise
        )
        columns = ("latitude", "longitude", "velocity_E", "velocity_N", "heading")
        values = np.broadcast_to(recorded, (len(seeds), *recorded.shape))
        ins = Stream("ins", time, values, columns, "sample", self.cfg.interval)
        truth = {
            "attitude_error_t": errors.attitude, "velocity_t": true[..., 2:4], "latitude": true[..., 0],
            "longitude": true[..., 1], "heading": np.mod(true[..., 4], 2.0 * np.pi),
            **{f"state:{plan.states[i]}": states[..., i] for i in np.flatnonzero(~np.array(plan.corrected))},
        }  # fmt: skip
        record = Record({"ins": ins, **references}, attributes={"source": self.cfg.kind, "truth": "linear"})  # type: ignore[attr-defined]
        return Draws(record, time, truth)

    def _states(
        self,
        plan: Plan,
        time: FloatArray,
        recorded: FloatArray,
        gravity: float,
        seeds: Sequence[np.random.SeedSequence],
        x: FloatArray,
    ) -> FloatArray:
        """States (R, K + 1, n) at the rows of the INS, from x (R, n)."""
        dt = np.diff(time)
        before = np.concatenate([recorded[:-1], np.zeros((dt.size, CORRECTION))], axis=1)
        samples = np.concatenate([dt[:, None], recorded[1:]], axis=1)
        _, rows, _ = step(before, samples, np.array([POINTS[plan.discretisation.evaluation], gravity]))
        complete = plan.layout.complete(rows)
        F = plan.F.evaluate(complete[0])
        Phi, Q, _ = plan.transitions(
            complete, np.zeros((dt.size, 0)), dt, lambda length: plan.discretisation.doublings(F, length)
        )
        normal = np.stack([np.random.default_rng(s).standard_normal((dt.size, x.shape[1])) for s in seeds])
        pushed = np.einsum("kij,rkj->rki", _factors(Q), normal * float(self.cfg.noise))
        states = np.empty((len(seeds), dt.size + 1, x.shape[1]))
        states[:, 0] = x
        for k in range(dt.size):
            states[:, k + 1] = np.einsum("ij,rj->ri", Phi[k], states[:, k]) + pushed[:, k]
        return states


def recorded_way(route: Route, every: int, latitude: float, longitude: float) -> tuple[FloatArray, FloatArray]:
    """Instants (K + 1,) and rows (K + 1, 5) of an INS that has no errors: place, velocity, heading.

    The latitude is that of phi' = V_N / R_M by the midpoint rule from node to node, the longitude by the trapezoid.
    """
    dt, V = np.diff(route.time), route.velocity
    middle = 0.5 * (V[1:, 1] + V[:-1, 1])
    L = np.empty(route.time.size)
    L[0] = latitude
    for k, north in enumerate(middle):
        half = L[k] + 0.5 * dt[k] * north * float(meridian_curvature(L[k]))
        L[k + 1] = L[k] + dt[k] * north * float(meridian_curvature(half))
    lam = longitude + trapezoid(route.time, V[:, 0] * prime_vertical_curvature(L) / np.cos(L))
    kept = slice(None, None, every)
    rows = np.stack([L, lam, V[:, 0], V[:, 1], np.mod(route.heading, 2.0 * np.pi)], axis=-1)
    return route.time[kept], rows[kept]


@dataclass(frozen=True, slots=True)
class _Errors:
    """Of the recorded INS, (R, K, ...): attitude (3), velocity (2), latitude, longitude."""

    attitude: FloatArray
    velocity: FloatArray
    latitude: FloatArray
    longitude: FloatArray
    knows_longitude: bool


def _errors(plan: Plan, row: FloatArray, states: FloatArray) -> _Errors:
    """By the slots of the provider, which say what each state is the error of."""
    slots = states @ plan.correction.evaluate(row).T
    known = bool(np.any(plan.correction.evaluate(row)[9]))
    return _Errors(slots[..., :3], slots[..., 3:5], slots[..., 6], slots[..., 9], known)


def _true(recorded: FloatArray, errors: _Errors) -> FloatArray:
    """Recorded minus error, (R, K, 5)."""
    parts = [errors.latitude[..., None], errors.longitude[..., None], errors.velocity, errors.attitude[..., 2:]]
    return np.asarray(recorded - np.concatenate(parts, axis=-1))


@dataclass(frozen=True, slots=True)
class _Way:
    """The true motion (R, K, 5) at any instant, even between the rows of the INS."""

    time: FloatArray
    rows: FloatArray

    def at(self, time: FloatArray) -> TrueMotion:
        unwrapped = self.rows.copy()
        unwrapped[..., 4] = np.unwrap(unwrapped[..., 4], axis=-1)
        k = np.clip(np.searchsorted(self.time, time - 1e-9) - 1, 0, self.time.size - 2)
        length = self.time[k + 1] - self.time[k]
        part = ((time - self.time[k]) / length)[:, None]
        now = unwrapped[:, k] * (1.0 - part) + unwrapped[:, k + 1] * part
        rate = np.mean(unwrapped[:, k + 1, 4] - unwrapped[:, k, 4], axis=0) / length
        return TrueMotion(now[..., 2:4], now[..., 4], now[..., 0], now[..., 1], rate)


def _as_set(cfg: SimulationConfig, plan: Plan) -> FloatArray:
    """The errors at the start (n,), by the names of the blocks; a block that is not there has none.

    Raises
    ------
    ConfigError
        One was set for a block that the model does not have.
    """
    x, names = np.zeros(len(plan.states)), [label.partition("[")[0] for label in plan.states]
    for key, block in BLOCKS.items():
        value = getattr(cfg.errors, key)
        numbers = np.atleast_1d(np.array(value.start if key == "gyro_drift" else value))
        own = [i for i, name in enumerate(names) if name == block]
        if own:
            x[own] = numbers[: len(own)]
        elif key in cfg.errors.model_fields_set and np.any(numbers):
            raise ConfigError(
                f"source.errors.{key}: with truth: linear the errors are states, and no block is called {block!r}",
                hint=did_you_mean(block, names),
            )
    return x


def _factors(covariance: FloatArray) -> FloatArray:
    """L with L L' = covariance (..., n, n)."""
    form = ud.factor(covariance)
    n = covariance.shape[-1]
    D = np.maximum(np.einsum("...ii->...i", form), 0.0)
    return np.asarray((np.triu(form, 1) + np.eye(n)) * np.sqrt(D)[..., None, :])
