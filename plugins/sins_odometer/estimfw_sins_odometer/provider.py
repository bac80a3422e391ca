"""The nominal provider ``sins_odometer.preintegration``."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np
from estimfw_inertial.mounting import MountingConfig, mounting
from estimfw_inertial.place import SAY_THE_SITE
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import PositiveInt, Settings, Site, quantity_vector
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError, DataError, NumericalError
from estimfw.model.nominal import (
    CompiledScan,
    CorrectionSlot,
    InitialNominal,
    NominalVariable,
    Operation,
    ProviderSettings,
    TermMirror,
)
from estimfw_sins_odometer import estimation
from estimfw_sins_odometer.place import pack_params
from estimfw_sins_odometer.preintegration import ROW_COLUMNS, Preintegrated
from estimfw_sins_odometer.samples import COLUMNS, odometer_samples, velocity_at

__all__ = ["BoundPreintegration", "Preintegration", "PreintegrationConfig", "Vehicle", "preintegration", "vehicle_of"]

FloatArray = NDArray[np.float64]
_Three = tuple[float, float, float]
_LEVER = quantity_vector("m", 3, examples=("[0.1 m, -1.2 m, -0.5 m]",))


class PreintegrationConfig(Settings):
    """``sins_odometer.preintegration``: IMU and odometer integrated in the axes of the start, from the stream ``imu``."""

    kind: Literal["sins_odometer.preintegration"]
    rows: Annotated[PositiveInt, Field(description="rows of the stream in a step, an even number")] = 100
    lever_arm: Annotated[_Three, _LEVER, Field(description="from the IMU to the odometer, right, forward, up")] = (
        0.0,
    ) * 3
    mounting: Annotated[MountingConfig | None, Field(description="turn of the IMU against the vehicle")] = None
    operations: Annotated[
        dict[str, Literal["follow", "on", "off"]],
        Field(description="transport_rate: follow the error model, or force"),
    ] = {}
    allow_mismatch: Annotated[
        bool, Field(description="run although error model and nominal differ, to show the damage")
    ] = False


@dataclass(frozen=True, slots=True)
class Vehicle:
    """Where it is, and how its sensors sit.

    ``latitude`` in rad, ``height`` in m; ``lever_arm`` from the IMU to the odometer in b, m; ``turn`` are the nine numbers of the
    rotation from the axes of the IMU to b.
    """

    latitude: float
    height: float
    rows: int
    lever_arm: _Three = (0.0, 0.0, 0.0)
    turn: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

    @property
    def matrix(self) -> FloatArray:
        """The rotation (3, 3) from the axes of the IMU to b."""
        return np.array(self.turn).reshape(3, 3)

    def params(self, transport: bool) -> FloatArray:
        """The flat parameters of `place`."""
        return pack_params(self.rows, transport, (self.latitude, self.height), self.lever_arm)

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        """See `odometer_samples`."""
        return odometer_samples(stream, rows, self.rows, self.matrix)

    def moving_start(self, given: InitialNominal, record: Record) -> InitialNominal:
        """A start with the velocity that the record has there; it is the time of its first row where none is given."""
        stream = record.streams.get("imu")
        if stream is None or len(stream) < 2:
            raise DataError("in-motion alignment needs the stream 'imu' with at least two rows")
        at = (
            0
            if given.time is None
            else int(np.clip(np.searchsorted(stream.time, given.time - 1e-9), 0, len(stream) - 1))
        )
        velocity = velocity_at(stream, at, self.matrix, np.array(self.lever_arm))
        return replace(given, values={**given.values, "velocity_b": velocity}, time=float(stream.time[at]))


@dataclass(frozen=True, slots=True)
class Preintegration:
    """The provider, before any data."""

    vehicle: Vehicle
    kind: str = field(default="sins_odometer.preintegration", init=False)
    stream: str | None = field(default="imu", init=False)
    columns: tuple[str, ...] = field(default=COLUMNS, init=False)
    operations: tuple[Operation, ...] = field(
        default=(
            Operation("transport_rate", TermMirror("transport_rate"), text="omega_en, from the odometer's speed"),
        ),
        init=False,
    )
    slots: tuple[CorrectionSlot, ...] = field(default=(CorrectionSlot("attitude", "i"),), init=False)

    @property
    def samples_per_step(self) -> int:
        return self.vehicle.rows

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        """The layout of a row; see `estimation`."""
        del computed
        return estimation.VARIABLES

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        """Every variable at the start."""
        row = self.bind(ProviderSettings(frozenset())).initial_row(initial)
        values, at = {}, 0
        for v in estimation.VARIABLES:
            values[v.name] = row[..., at : at + v.size].reshape((*row.shape[:-1], *v.shape))
            at += v.size
        return values

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        """The given attitude, else what the record itself says, and the velocity there.

        Raises
        ------
        DataError
            Nobody says the attitude.
        """
        if given is None and "C_bn" not in record.initial:
            raise DataError(
                "nobody says what the attitude at the start is",
                hint="add `initial_attitude: {kind: sins_odometer.level, heading: ...}`, which levels with the first second",
            )
        known = given or InitialNominal({"C_bn": record.initial["C_bn"]}, source="the record")
        return self.vehicle.moving_start(known, record)

    def bind(self, settings: ProviderSettings) -> BoundPreintegration:
        """The pure functions, for what is computed."""
        return BoundPreintegration(self.vehicle, self.vehicle.params("transport_rate" in settings.computed))


@dataclass(frozen=True, slots=True, eq=False)
class BoundPreintegration:
    """The provider bound to the structure of a model; flat arrays as in `estimation`."""

    vehicle: Vehicle
    params: FloatArray
    n_state: int = field(default=estimation.N_STATE, init=False)
    compiled: CompiledScan | None = field(
        default=CompiledScan("estimfw_sins_odometer.compiled", "estimation_step", "correct"), init=False
    )

    @property
    def n_sample(self) -> int:
        return 1 + ROW_COLUMNS * self.vehicle.rows

    def initial_state(self, initial: InitialNominal) -> FloatArray:
        """State (..., 55): the transpose of C_bn is C_ni, for i is b at the start."""
        C = np.asarray(initial.values["C_bn"], dtype=float)
        velocity = np.asarray(initial.values.get("velocity_b", np.zeros(3)), dtype=float)
        return estimation.initial(np.swapaxes(C, -1, -2), velocity)

    def initial_row(self, initial: InitialNominal) -> FloatArray:
        """Row (..., 81) at the start: nothing is measured yet."""
        state = self.initial_state(initial)
        now, A = Preintegrated.of(state), state[..., -9:].reshape(*state.shape[:-1], 3, 3)
        still = np.zeros(now.r.shape)
        return estimation.row_of(now, A, now.r, still, still, self.params)

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        """Samples (K, n_sample)."""
        return self.vehicle.samples(stream, rows)

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New state, process row, end row."""
        return estimation.step(state, sample, self.params)

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        """exp([phi x]) C_ni for delta (..., 3), in i."""
        return estimation.correct(state, delta, self.params)

    def difference(self, state: FloatArray, other: FloatArray) -> FloatArray:
        """phi (..., 3) in i, by which the attitude of one state has to be corrected to be that of the other."""
        return estimation.difference(state, other)


def vehicle_of(site: Site | None, rows: int, lever_arm: _Three, turned: MountingConfig | None, kind: str) -> Vehicle:
    """What a config says of the vehicle.

    Raises
    ------
    ConfigError
        No site, or an odd number of rows.
    NumericalError
        At a pole.
    """
    if site is None:
        raise ConfigError(f"nominal {kind} needs the place, for gravity and the Earth's rate", hint=SAY_THE_SITE)
    if rows % 2:
        raise ConfigError(f"nominal {kind}: {rows} rows in a step, an even number is due", hint="two rows make a block")
    if np.pi / 2 - abs(site.latitude) < 1e-9:
        raise NumericalError(f"latitude {np.degrees(site.latitude):g} deg: there is no North at a pole")
    turn = mounting(turned).C if turned is not None else np.eye(3)
    return Vehicle(site.latitude, site.height, rows, lever_arm, tuple(turn.ravel().tolist()))


def preintegration(cfg: PreintegrationConfig, site: Site | None) -> Preintegration:
    """The provider that a config describes."""
    return Preintegration(vehicle_of(site, cfg.rows, cfg.lever_arm, cfg.mounting, cfg.kind))
