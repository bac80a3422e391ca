"""The nominal provider ``sins_odometer.determination``: its attitude is the answer, so there are no states and no covariance."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from estimfw_inertial.mounting import MountingConfig
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import PositiveInt, Settings, Site, non_negative_quantity, quantity_vector
from estimfw.data.record import Record, Stream
from estimfw.model.nominal import (
    CompiledScan,
    CorrectionSlot,
    InitialNominal,
    NominalVariable,
    Operation,
    ProviderSettings,
)
from estimfw.model.parts import Output
from estimfw_sins_odometer import determination
from estimfw_sins_odometer.attitude import determined_output
from estimfw_sins_odometer.level import Level
from estimfw_sins_odometer.preintegration import ROW_COLUMNS, Preintegrated
from estimfw_sins_odometer.provider import Vehicle, vehicle_of
from estimfw_sins_odometer.samples import COLUMNS

__all__ = ["BoundDetermination", "Determination", "DeterminationConfig", "determined"]

FloatArray = NDArray[np.float64]
_Three = tuple[float, float, float]
_LEVER = quantity_vector("m", 3, examples=("[0.1 m, -1.2 m, -0.5 m]",))


class DeterminationConfig(Settings):
    """``sins_odometer.determination``: the attitude that fits the integrated velocities best (Wahba), from the stream ``imu``."""

    kind: Literal["sins_odometer.determination"]
    rows: Annotated[PositiveInt, Field(description="rows of the stream in a step, an even number")] = 100
    lever_arm: Annotated[_Three, _LEVER, Field(description="from the IMU to the odometer, right, forward, up")] = (
        0.0,
    ) * 3
    mounting: Annotated[MountingConfig | None, Field(description="turn of the IMU against the vehicle")] = None
    first: Annotated[
        float,
        non_negative_quantity("s"),
        Field(description="when an attitude is determined first, and its velocity used"),
    ] = 10.0
    normalised: Annotated[bool, Field(description="vectors of length 1: a control, much worse")] = False
    transport: Annotated[bool, Field(description="false: no omega_en and no Coriolis: a control, worse")] = True


@dataclass(frozen=True, slots=True)
class Determination:
    """The provider, before any data. ``first`` in s."""

    vehicle: Vehicle
    first: float = 10.0
    normalised: bool = False
    transport: bool = True
    kind: str = field(default="sins_odometer.determination", init=False)
    stream: str | None = field(default="imu", init=False)
    columns: tuple[str, ...] = field(default=COLUMNS, init=False)
    operations: tuple[Operation, ...] = field(default=(), init=False)
    slots: tuple[CorrectionSlot, ...] = field(default=(), init=False)

    @property
    def samples_per_step(self) -> int:
        return self.vehicle.rows

    @property
    def outputs(self) -> tuple[Output, ...]:
        """``attitude``: yaw, pitch, roll, heading."""
        return (determined_output(),)

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        """The layout of a row; see `determination`."""
        del computed
        return determination.VARIABLES

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        """Every variable at the start."""
        row = self.bind(ProviderSettings(frozenset())).initial_row(initial)
        values, at = {}, 0
        for v in determination.VARIABLES:
            values[v.name] = row[..., at : at + v.size].reshape((*row.shape[:-1], *v.shape))
            at += v.size
        return values

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        """The velocity there; level and heading North, for the seconds before the first attitude, where none is given."""
        if given is None:
            given = Level(0.0, 1, 1.0, 0.0, 0.1, np.pi, self.vehicle.turn).find(record)
        return self.vehicle.moving_start(given, record)

    def bind(self, settings: ProviderSettings) -> BoundDetermination:
        """The pure functions."""
        del settings
        place = self.vehicle.params(self.transport)
        return BoundDetermination(self.vehicle, np.concatenate([place, [float(self.normalised), self.first]]))


@dataclass(frozen=True, slots=True, eq=False)
class BoundDetermination:
    """The provider as pure functions on the flat arrays of `determination`."""

    vehicle: Vehicle
    params: FloatArray
    n_state: int = field(default=determination.N_STATE, init=False)
    compiled: CompiledScan | None = field(
        default=CompiledScan("estimfw_sins_odometer.compiled", "determination_step", "keep"), init=False
    )

    @property
    def n_sample(self) -> int:
        return 1 + ROW_COLUMNS * self.vehicle.rows

    def initial_state(self, initial: InitialNominal) -> FloatArray:
        """State (..., 84)."""
        C = np.asarray(initial.values["C_bn"], dtype=float)
        velocity = np.asarray(initial.values.get("velocity_b", np.zeros(3)), dtype=float)
        return determination.initial(C, velocity, self.vehicle.latitude)

    def initial_row(self, initial: InitialNominal) -> FloatArray:
        """Row (..., 28) at the start."""
        state = self.initial_state(initial)
        turned, start = (state[..., at : at + 9].reshape(*state.shape[:-1], 3, 3) for at in (46, 74))
        nothing = np.zeros((*state.shape[:-1], 3))
        return determination.row_of(Preintegrated.of(state), turned, start, nothing, nothing[..., 0])

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        """Samples (K, n_sample)."""
        return self.vehicle.samples(stream, rows)

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New state, process row, end row."""
        return determination.step(state, sample, self.params)

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        """Nothing can be corrected."""
        del delta
        return state.copy()


def determined(cfg: DeterminationConfig, site: Site | None) -> Determination:
    """The provider that a config describes."""
    vehicle = vehicle_of(site, cfg.rows, cfg.lever_arm, cfg.mounting, cfg.kind)
    return Determination(vehicle, cfg.first, cfg.normalised, cfg.transport)
