"""The paper's experiment: a base at rest (or swaying), an IMU with biases and white noise, a misaligned start.

Increments over an interval dt, exact for the motion (spec of the experiment, one epoch)::

    dtheta = log(C_k^T exp([omega_ie dt x]) C_k+1) + eps dt + ARW sqrt(dt) n_g
    dv     = C_mid^T f_n dt + a dt + VRW sqrt(dt) n_a

At rest these are (C^T omega_ie + eps) dt and (C^T f_n + a) dt. The start is exp(-[phi x]) C. Scale factors, slow drifts and
quantisation come in with ``imu``; see `estimfw_inertial.imu_errors`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from estimfw_inertial.earth import earth_rate_n, normal_gravity
from estimfw_inertial.imu_errors import ImuErrors, RealisedErrors, SensorErrors, apply
from estimfw_inertial.imu_errors_config import ImuErrorsConfig, imu_errors
from estimfw_inertial.increments import IMU_COLUMNS
from estimfw_inertial.place import SAY_THE_SITE
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial.transform import Rotation

from estimfw.config.types import (
    Settings,
    Site,
    non_negative_quantity,
    non_negative_quantity_vector,
    positive_quantity,
    quantity_vector,
)
from estimfw.data.draws import Draws
from estimfw.data.memory import refuse_too_large
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError
from estimfw.model.nominal import InitialNominal
from estimfw_sins_static.run_starts import RunStarts, starts_as_set, starts_drawn

__all__ = ["SimulateConfig", "Simulation", "simulate"]

FloatArray = NDArray[np.float64]
DEGREE = np.pi / 180.0
STANDARD_GRAVITY = 9.80665
_Three = tuple[float, float, float]
#: The fields that ``imu`` stands for, and where it has them.
_INSTEAD = {
    "gyro_bias": "gyro: {bias: ...}",
    "accel_bias": "accel: {bias: ...}",
    "gyro_noise": "gyro: {random_walk: ...}",
    "accel_noise": "accel: {random_walk: ...}",
    "gyro_bias_sigma": "gyro: {bias_sigma: ...}",
    "accel_bias_sigma": "accel: {bias_sigma: ...}",
}


class SwayConfig(Settings):
    """Sinusoidal sway about E, N, U: amplitude and period of each."""

    amplitude: Annotated[_Three, non_negative_quantity_vector("rad", 3), Field(description="about E, N, U")]
    period: Annotated[float, positive_quantity("s"), Field(description="of the sinus")] = 8.0


class SimulateConfig(Settings):
    """The base stands at ``initial_attitude``; the filter starts misaligned from it.

    ``noise: false`` switches the white noises off; the biases stay. The defaults are the paper's sensors; ``imu`` stands for
    any others, such as ``{grade: tactical}``, and takes the place of the four biases and noises.

    In a Monte Carlo each run draws, besides its noises, what the filter's prior is about: the misalignment, the velocity at the
    start, and the biases (those of ``imu`` as it says itself). A ``..._sigma`` draws about the setting of that name instead.
    """

    kind: Literal["sins_static.simulate"]
    duration: Annotated[float, positive_quantity("s"), Field(description="length of the record")] = 600.0
    rate: Annotated[float, positive_quantity("Hz"), Field(description="samples of the IMU a second")] = 1.0
    misalignment: Annotated[
        _Three,
        quantity_vector("rad", 3),
        Field(description="rotation vector phi about E, N, U; the filter starts at exp(-[phi x]) C_bn"),
    ] = (0.0,) * 3
    noise: Annotated[bool, Field(description="false: no white noises; the biases stay")] = True
    seed: Annotated[int, Field(description="of the noises, and of what a grade draws")] = 1
    gyro_bias: Annotated[_Three, quantity_vector("rad/s", 3), Field(description="of all axes or of each, in b")] = (
        0.01 * DEGREE / 3600.0,
    ) * 3
    accel_bias: Annotated[_Three, quantity_vector("m/s^2", 3), Field(description="of all axes or of each, in b")] = (
        100e-6 * STANDARD_GRAVITY,
    ) * 3
    gyro_noise: Annotated[
        _Three,
        non_negative_quantity_vector("rad/sqrt(s)", 3, examples=("0.001 deg/sqrt(h)",)),
        Field(description="angle random walk"),
    ] = (0.001 * DEGREE / 60.0,) * 3
    accel_noise: Annotated[
        _Three,
        non_negative_quantity_vector("m/s/sqrt(s)", 3, examples=("10 ug/sqrt(Hz)",)),
        Field(description="velocity random walk"),
    ] = (10e-6 * STANDARD_GRAVITY,) * 3
    imu: Annotated[
        ImuErrorsConfig | None,
        Field(description="errors of the sensors by grade or figure, in place of the biases and noises above"),
    ] = None
    velocity_noise: Annotated[
        float,
        non_negative_quantity("m/s"),
        Field(description="of the stream velocity_reference, which is there if this is not 0"),
    ] = 0.0
    draw: Annotated[
        Literal["prior", "noise"],
        Field(description="of the runs of a Monte Carlo: start and biases from the filter's prior, or noises alone"),
    ] = "prior"
    misalignment_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("rad", 3)] | None,
        Field(description="of a Monte Carlo: one sigma about misalignment, in place of the prior"),
    ] = None
    velocity_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("m/s", 3)] | None,
        Field(description="of a Monte Carlo: one sigma of the computed velocity at the start, in place of the prior"),
    ] = None
    gyro_bias_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("rad/s", 3, examples=("0.01 deg/h",))] | None,
        Field(description="of a Monte Carlo: one sigma about gyro_bias, in place of the prior"),
    ] = None
    accel_bias_sigma: Annotated[
        Annotated[_Three, non_negative_quantity_vector("m/s^2", 3, examples=("100 ug",))] | None,
        Field(description="of a Monte Carlo: one sigma about accel_bias, in place of the prior"),
    ] = None
    sway: Annotated[SwayConfig | None, Field(description="how the base sways; it stands still if left out")] = None


@dataclass(frozen=True, slots=True)
class Simulation:
    """A source: ``load`` makes the record anew, the same every time for the same settings."""

    cfg: SimulateConfig
    site: Site
    C_bn: FloatArray

    @property
    def turn_angles(self) -> dict[str, float]:
        """Largest angle (rad) by which the body turns against n in the run."""
        return {"b": 0.0 if self.cfg.sway is None else 2.0 * float(np.linalg.norm(self.cfg.sway.amplitude))}

    @property
    def start_values(self) -> dict[str, FloatArray]:
        """Where the mechanization starts: misaligned from the attitude that the vehicle stands at."""
        return {"C_bn": self._starts(starts_as_set(self.cfg, 1).misalignment)[0]}

    @property
    def seed(self) -> int:
        return self.cfg.seed

    def load(self) -> Record:
        """Streams ``imu`` and, where velocity noise is asked for, ``velocity_reference``; the truth; the start."""
        made = self._records([np.random.SeedSequence(self.cfg.seed)], starts_as_set(self.cfg, 1)).run(0)
        return replace(made, attributes={**made.attributes, "seed": self.cfg.seed})

    def drawn_many(self, seeds: Sequence[np.random.SeedSequence], start: Mapping[str, FloatArray]) -> Draws:
        """Runs of a Monte Carlo; see `estimfw.montecarlo.draw`."""
        return self._records(seeds, starts_drawn(self.cfg, seeds, start))

    def _records(self, seeds: Sequence[np.random.SeedSequence], starts: RunStarts) -> Draws:
        cfg, dt = self.cfg, 1.0 / self.cfg.rate
        count = round(cfg.duration * cfg.rate)
        if count < 1:
            raise ConfigError(f"source: {cfg.duration:g} s at {cfg.rate:g} Hz is not even one sample")
        refuse_too_large(
            8.0 * 120.0 * count, f"{count:.3g} samples of an IMU", "a shorter `duration` or a lower `rate`"
        )
        time = dt * np.arange(1, count + 1, dtype=np.float64)
        edges, middles = self._attitude(dt * np.arange(count + 1, dtype=np.float64)), self._attitude(time - 0.5 * dt)
        true = np.hstack(ideal_increments(edges, middles, self.site, dt))
        base, measured, noises = self._errors(), np.empty((len(seeds), count, 6)), []
        realised: list[RealisedErrors] = []
        for i, seed in enumerate(seeds):
            of_imu, of_velocity = seed.spawn(2)
            measured[i], real = apply(true, dt, np.random.default_rng(of_imu), self._errors_of(base, starts, i))
            realised.append(real)
            noises.append(of_velocity)
        initial = {"C_bn": self._starts(starts.misalignment)}
        initial |= {} if starts.velocity is None else {"velocity_n": starts.velocity}
        streams = {"imu": Stream("imu", time, measured, IMU_COLUMNS, "increment", dt)}
        record = Record(
            streams={**streams, **self._velocity_reference(time, noises)},
            initial=initial,
            attributes={"source": "sins_static.simulate"},
        )
        return Draws(record, time, _truth(edges[1:], realised))

    def _starts(self, misalignment: FloatArray) -> FloatArray:
        """exp(-[phi x]) C_bn (R, 3, 3) for phi (R, 3)."""
        turn = Rotation.from_rotvec(-misalignment).as_matrix()
        return np.asarray(turn @ self._attitude(np.zeros(1))[0], dtype=float)

    def _attitude(self, time: FloatArray) -> FloatArray:
        if self.cfg.sway is None:
            return np.broadcast_to(self.C_bn, (time.size, 3, 3))
        phase = np.sin(2.0 * np.pi * time / self.cfg.sway.period)
        turn = Rotation.from_rotvec(phase[:, None] * np.array(self.cfg.sway.amplitude)).as_matrix()
        return np.asarray(turn @ self.C_bn, dtype=float)

    def _velocity_reference(self, time: FloatArray, seeds: Sequence[np.random.SeedSequence]) -> dict[str, Stream]:
        if not self.cfg.velocity_noise:
            return {}
        drawn = [np.random.default_rng(seed).standard_normal((time.size, 3)) for seed in seeds]
        values = self.cfg.velocity_noise * np.stack(drawn)
        return {"velocity_reference": Stream("velocity_reference", time, values, ("E", "N", "U"), "sample", time[0])}

    def _errors(self) -> ImuErrors:
        cfg = self.cfg
        if cfg.imu is not None:
            errors = imu_errors(cfg.imu)
        else:
            errors = ImuErrors(
                SensorErrors(bias=cfg.gyro_bias, random_walk=cfg.gyro_noise),
                SensorErrors(bias=cfg.accel_bias, random_walk=cfg.accel_noise),
            )
        if cfg.noise:
            return errors
        return ImuErrors(replace(errors.gyro, random_walk=0.0), replace(errors.accel, random_walk=0.0))

    def _errors_of(self, errors: ImuErrors, starts: RunStarts, i: int) -> ImuErrors:
        """With the biases of one run; a sensor of ``imu`` draws its own."""
        if self.cfg.imu is not None:
            return errors
        gyro, accel = _three(starts.gyro_bias[i]), _three(starts.accel_bias[i])
        return ImuErrors(replace(errors.gyro, bias=gyro), replace(errors.accel, bias=accel))


def _three(vector: FloatArray) -> _Three:
    x, y, z = vector.tolist()
    return x, y, z


def _truth(C_bn: FloatArray, realised: Sequence[RealisedErrors]) -> dict[str, FloatArray]:
    """Of runs; biases are what was drawn for each, with their drift; a scale factor is no bias."""
    return {
        "C_bn": np.asarray(C_bn)[None],
        "velocity_n": np.zeros((1, len(C_bn), 3)),
        "accel_bias_b": np.stack([one.accel.bias for one in realised]),
        "gyro_bias_b": np.stack([one.gyro.bias for one in realised]),
    }


def ideal_increments(edges: FloatArray, middles: FloatArray, site: Site, dt: float) -> tuple[FloatArray, FloatArray]:
    """Error-free increments of an IMU at a fixed place.

    Parameters
    ----------
    edges : (N + 1, 3, 3) array
        C_bn at the ends of the intervals.
    middles : (N, 3, 3) array
        C_bn at their middles.
    site : Site
    dt : float, s

    Returns
    -------
    dtheta, dvel : (N, 3) array, rad and m/s, in b
    """
    earth = Rotation.from_rotvec(np.asarray(earth_rate_n(site.latitude)) * dt).as_matrix()
    dtheta = Rotation.from_matrix(np.swapaxes(edges[:-1], -1, -2) @ earth @ edges[1:]).as_rotvec()
    gravity = float(normal_gravity(site.latitude, site.height))
    dvel = np.swapaxes(middles, -1, -2) @ np.array([0.0, 0.0, gravity]) * dt
    return dtheta, dvel


def simulate(cfg: SimulateConfig, site: Site | None, initial: InitialNominal | None) -> Simulation:
    """The source of the paper's experiment; it needs a site, and the true attitude from ``initial_attitude``."""
    if site is None:
        raise ConfigError("source sins_static.simulate needs a site", hint=SAY_THE_SITE)
    given = [name for name in _INSTEAD if name in cfg.model_fields_set] if cfg.imu is not None else []
    if given:
        raise ConfigError(
            f"source sins_static.simulate has `imu` and `{given[0]}`, which say the same",
            hint=f"move `{given[0]}` into `imu`, as `{_INSTEAD[given[0]]}`",
        )
    C_bn = initial.values["C_bn"] if initial is not None else np.eye(3)
    return Simulation(cfg, site, np.asarray(C_bn, dtype=float))
