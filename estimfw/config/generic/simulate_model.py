"""A source for any model whose nominal no stream moves: the model itself, simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Strict

from estimfw.config.types import Settings, Site, positive_quantity
from estimfw.data.draws import Draws
from estimfw.data.memory import refuse_too_large
from estimfw.data.record import SAME, Record, Stream
from estimfw.data.timeline import Steps, Wanted, merged_steps
from estimfw.errors import ConfigError, NumericalError
from estimfw.kernels import ud
from estimfw.model.nominal import InitialNominal
from estimfw.plan.inputs import input_values, inputs_at
from estimfw.plan.over_time import RowsOverTime
from estimfw.plan.plan import MeasurementPlan, Plan
from estimfw.spelling import did_you_mean

__all__ = ["ModelSimulation", "SimulateModelConfig", "simulate_model"]

FloatArray = NDArray[np.float64]


class SimulateModelConfig(Settings):
    """Draws the start from the prior, then process noise and measurement noise, all from ``seed``.

    ``rates`` gives the rate of a measurement by name where it differs from ``rate``.
    """

    kind: Literal["simulate_model"]
    duration: Annotated[float, positive_quantity("s"), Field(description="of the simulated record")]
    rate: Annotated[float, positive_quantity("Hz"), Field(description="of the readings")]
    rates: Annotated[
        dict[str, Annotated[float, positive_quantity("Hz")]],
        Field(description="by measurement, where it differs from rate"),
    ] = {}
    noise: Annotated[bool, Field(description="false: no noise, and the start at the prior's mean")] = True
    seed: Annotated[int, Strict(), Field(ge=0, description="of all random numbers")] = 1


@dataclass(frozen=True, slots=True)
class ModelSimulation:
    """x <- Phi x + d + w, z = H x + v for a plan whose nominal is constant, or follows a schedule (`along`)."""

    cfg: SimulateModelConfig
    schedule: RowsOverTime | None = None

    @property
    def seed(self) -> int:
        return self.cfg.seed

    def along(self, schedule: RowsOverTime) -> ModelSimulation:
        """The same, of a nominal that changes over time."""
        return replace(self, schedule=schedule)

    def load_for(self, plan: Plan, row: FloatArray) -> Record:
        """The record of one run, of ``seed``; parameters and faults as `drawn_many_for`."""
        made = self.drawn_many_for(plan, row, [np.random.SeedSequence(self.cfg.seed)], {}).run(0)
        return replace(made, attributes={**made.attributes, "seed": self.cfg.seed})

    def drawn_many_for(
        self, plan: Plan, row: FloatArray, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, FloatArray]
    ) -> Draws:
        """Runs of a Monte Carlo; each draws its start itself, as the single one does.

        Parameters
        ----------
        plan : Plan
        row : (size,) array
            The nominal; where it follows a schedule, that at the start.
        seeds : sequence of R SeedSequence
        start : mapping
            Not used.

        Raises
        ------
        ConfigError
            The nominal changes, an input is measured, or ``rates`` names a measurement that is not there.
        """
        if any(change == "varying" for _, _, change in plan.varying):
            raise ConfigError(f"source simulate_model cannot simulate a changing nominal: {plan.reason}")
        for known in plan.inputs:
            if known.stream is not None:
                raise ConfigError(
                    f"source simulate_model cannot make the readings of the input {known.name!r}",
                    hint="use a schedule, or a log",
                )
        for name in self.cfg.rates:
            if name not in {m.name for m in plan.measurements}:
                hint = did_you_mean(name, (m.name for m in plan.measurements))
                raise ConfigError(f"source.rates names no measurement: {name!r}", hint=hint)
        self._refuse_too_long(plan)
        children = [seed.spawn(2) for seed in seeds]
        process, reading = ([np.random.default_rng(two[k]) for two in children] for k in range(2))
        times = {m.name: self._times(m) for m in plan.measurements}
        steps = self._steps(plan, times)
        rows, ends = self._rows(row, steps)
        with np.errstate(over="ignore", invalid="ignore"):
            states = self._states(plan, rows, steps, process)
        _refuse_infinite(states, plan, steps)
        streams = {}
        for m in plan.measurements:
            at = np.searchsorted(steps.time, times[m.name] - SAME)
            streams[str(m.stream)] = self._stream(m, ends[at], times[m.name], states[:, at], reading)
        truth = {f"state:{label}": states[:, :, i] for i, label in enumerate(plan.states)}
        initial = {"time": np.zeros(len(seeds))}
        return Draws(Record(streams, initial=initial, attributes={"source": "simulate_model"}), steps.time, truth)

    def _refuse_too_long(self, plan: Plan) -> None:
        counts = {m.name: self.cfg.duration * self.cfg.rates.get(m.name, self.cfg.rate) for m in plan.measurements}
        steps, n = sum(counts.values()), len(plan.states)
        needed = 8.0 * (steps * (5 * n + 4) + sum(counts[m.name] * (4 * m.rows + 2) for m in plan.measurements))
        refuse_too_large(needed, f"{steps:.3g} steps of {n} states", "a shorter `duration` or a lower `rate`")

    def _times(self, m: MeasurementPlan) -> FloatArray:
        rate = float(self.cfg.rates.get(m.name, self.cfg.rate))
        return np.asarray(np.arange(1, int(self.cfg.duration * rate + 1e-9) + 1) / rate)

    def _steps(self, plan: Plan, times: dict[str, FloatArray]) -> Steps:
        streams = {n: Stream(n, t, np.zeros((t.size, 1)), ("z",)) for n, t in times.items()}
        wanted = [Wanted(n, n) for n in times]
        instants = [t for known in plan.inputs for t in known.times if 0.0 < t < self.cfg.duration]
        instants += [t for t in (self.schedule.instants if self.schedule else ()) if 0.0 < t < self.cfg.duration]
        return merged_steps(streams, wanted, instants=instants, start=0.0)

    def _rows(self, row: FloatArray, steps: Steps) -> tuple[FloatArray, FloatArray]:
        """Process rows and end rows (K, size)."""
        if self.schedule is not None:
            return self.schedule.between(steps.begin, steps.time)
        alike = np.broadcast_to(row, (len(steps), row.size))
        return alike, alike

    def _states(
        self, plan: Plan, rows: FloatArray, steps: Steps, generators: Sequence[np.random.Generator]
    ) -> FloatArray:
        """States (R, K, n) at the ends of the steps, for process rows (K, size)."""
        mean, covariance = plan.prior.evaluate(plan.layout.unpack(rows[0]))
        shape = (len(steps) + 1, len(mean))
        normal = np.stack([rng.standard_normal(shape) for rng in generators]) * self.cfg.noise
        x = mean + _times(_factor(covariance), normal[:, 0])
        F, watched = plan.F.evaluate(rows[0]), list(plan.watched)
        states = np.empty((len(generators), len(steps), len(mean)))
        begin = np.concatenate([[steps.start], steps.time[:-1]])
        known = inputs_at([input_values(i, {}) for i in plan.inputs], begin)
        made: dict[tuple[float, bytes], tuple[FloatArray, FloatArray, FloatArray]] = {}
        for k, dt in enumerate(steps.dt):
            u, row = known[k], rows[k]
            key = (float(dt), u.tobytes() + row[watched].tobytes())
            if key not in made:
                Phi, Q, d = plan.discretised(row, u, np.array(dt), plan.discretisation.doublings(F, float(dt)))
                made[key] = Phi, _factor(Q), d
            Phi, factor, d = made[key]
            x = _times(Phi, x) + d + _times(factor, normal[:, k + 1])
            states[:, k] = x
        return states

    def _stream(
        self,
        m: MeasurementPlan,
        rows: FloatArray,
        time: FloatArray,
        states: FloatArray,
        generators: Sequence[np.random.Generator],
    ) -> Stream:
        H, R = m.H.evaluate(rows), np.array(m.R)
        period = float(time[0]) if time.size else 1.0
        normal = np.stack([rng.standard_normal((time.size, m.rows)) for rng in generators]) * self.cfg.noise
        noise = _times(_factor(R / (period if m.density else 1.0)), normal)
        z = np.einsum("kij,rkj->rki", H, states) + noise - m.innovation.evaluate(rows)[..., 0]
        return Stream(str(m.stream), time, m.sign * z, m.columns, "sample", period)


def _times(A: FloatArray, x: FloatArray) -> FloatArray:
    """A x for x (..., n), summed alike however many x there are."""
    return np.asarray(np.einsum("ij,...j->...i", A, x))


def _refuse_infinite(states: FloatArray, plan: Plan, steps: Steps) -> None:
    bad = np.argwhere(~np.isfinite(states))
    if bad.size:
        _, k, i = bad[0]
        raise NumericalError(
            f"the simulated {plan.states[i]} left the numbers at t = {steps.time[k]:g} s",
            hint="the model is unstable: it grows without bound; check the signs of its coefficients",
        )


def _factor(covariance: FloatArray) -> FloatArray:
    """L with L L' = covariance; from U D U', which no eigensolver can fail to find."""
    form = ud.factor(covariance)
    D = np.maximum(np.diag(form), 0.0)
    return np.asarray((np.triu(form, 1) + np.eye(len(D))) * np.sqrt(D))


def simulate_model(cfg: SimulateModelConfig, site: Site | None, initial: InitialNominal | None) -> ModelSimulation:
    return ModelSimulation(cfg)
