"""The nominal provider ``sins_odometer.preintegration``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Site
from estimfw.data.record import Record
from estimfw.errors import DataError
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
from estimfw_sins_odometer.preintegration import Preintegrated
from estimfw_sins_odometer.samples import COLUMNS
from estimfw_sins_odometer.vehicle import BoundVehicle, Vehicle, VehicleConfig, unpacked, vehicle_of

__all__ = ["BoundPreintegration", "Preintegration", "PreintegrationConfig", "preintegration"]

FloatArray = NDArray[np.float64]
_Three = tuple[float, float, float]


class PreintegrationConfig(VehicleConfig):
    """``sins_odometer.preintegration``: IMU and odometer integrated in the axes of the start, from the stream ``imu``."""

    kind: Literal["sins_odometer.preintegration"]
    operations: Annotated[
        dict[str, Literal["follow", "on", "off"]],
        Field(description="transport_rate: follow the error model, or force"),
    ] = {}
    allow_mismatch: Annotated[
        bool, Field(description="run although error model and nominal differ, to show the damage")
    ] = False


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
        return unpacked(estimation.VARIABLES, self.bind(ProviderSettings(frozenset())).initial_row(initial))

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
class BoundPreintegration(BoundVehicle):
    """The provider bound to the structure of a model; flat arrays as in `estimation`."""

    n_state: int = field(default=estimation.N_STATE, init=False)
    compiled: CompiledScan | None = field(
        default=CompiledScan("estimfw_sins_odometer.compiled", "estimation_step", "correct"), init=False
    )

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

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New state, process row, end row."""
        return estimation.step(state, sample, self.params)

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        """exp([phi x]) C_ni for delta (..., 3), in i."""
        return estimation.correct(state, delta, self.params)

    def difference(self, state: FloatArray, other: FloatArray) -> FloatArray:
        """phi (..., 3) in i, by which the attitude of one state has to be corrected to be that of the other."""
        return estimation.difference(state, other)


def preintegration(cfg: PreintegrationConfig, site: Site | None) -> Preintegration:
    """The provider that a config describes."""
    return Preintegration(vehicle_of(cfg, cfg.kind, site))
