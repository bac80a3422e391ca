"""The nominal provider ``sins_odometer.determination``: its attitude is the answer, so there are no states and no covariance."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Site, non_negative_quantity
from estimfw.data.record import Record
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
from estimfw_sins_odometer.preintegration import Preintegrated
from estimfw_sins_odometer.samples import COLUMNS
from estimfw_sins_odometer.vehicle import BoundVehicle, Vehicle, VehicleConfig, unpacked, vehicle_of

__all__ = ["BoundDetermination", "Determination", "DeterminationConfig", "determined"]

FloatArray = NDArray[np.float64]
_Three = tuple[float, float, float]


class DeterminationConfig(VehicleConfig):
    """``sins_odometer.determination``: the attitude that fits the integrated velocities best (Wahba), from the stream ``imu``."""

    kind: Literal["sins_odometer.determination"]
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
        return unpacked(determination.VARIABLES, self.bind(ProviderSettings(frozenset())).initial_row(initial))

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
class BoundDetermination(BoundVehicle):
    """The provider as pure functions on the flat arrays of `determination`."""

    n_state: int = field(default=determination.N_STATE, init=False)
    compiled: CompiledScan | None = field(
        default=CompiledScan("estimfw_sins_odometer.compiled", "determination_step", "keep"), init=False
    )

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

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New state, process row, end row."""
        return determination.step(state, sample, self.params)

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        """Nothing can be corrected."""
        del delta
        return state.copy()


def determined(cfg: DeterminationConfig, site: Site | None) -> Determination:
    """The provider that a config describes."""
    vehicle = vehicle_of(cfg, cfg.kind, site)
    return Determination(vehicle, cfg.first, cfg.normalised, cfg.transport)
