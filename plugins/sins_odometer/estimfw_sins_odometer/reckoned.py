"""The nominal provider ``sins_odometer.dead_reckoning``: the track of a vehicle whose attitude is known at the start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Site, quantity_vector
from estimfw.data.record import Record
from estimfw.errors import DataError
from estimfw.model.nominal import (
    CompiledScan,
    CorrectionSlot,
    InitialNominal,
    NominalVariable,
    Operation,
    ProviderSettings,
)
from estimfw.model.parts import Output
from estimfw_sins_odometer import reckoning
from estimfw_sins_odometer.attitude import determined_output
from estimfw_sins_odometer.samples import COLUMNS
from estimfw_sins_odometer.vehicle import BoundVehicle, Vehicle, VehicleConfig, unpacked, vehicle_of

__all__ = ["BoundReckoning", "DeadReckoning", "DeadReckoningConfig", "dead_reckoning"]

FloatArray = NDArray[np.float64]
_Three = tuple[float, float, float]


class DeadReckoningConfig(VehicleConfig):
    """``sins_odometer.dead_reckoning``: attitude by the gyros, way by the odometer, from the stream ``imu``."""

    kind: Literal["sins_odometer.dead_reckoning"]
    position: Annotated[
        _Three, quantity_vector("m", 3), Field(description="at the start, east, north and up of the site")
    ] = (0.0,) * 3


@dataclass(frozen=True, slots=True)
class DeadReckoning:
    """The provider, before any data. ``position`` at the start, m east, north, up of the site."""

    vehicle: Vehicle
    position: _Three = (0.0, 0.0, 0.0)
    kind: str = field(default="sins_odometer.dead_reckoning", init=False)
    stream: str | None = field(default="imu", init=False)
    columns: tuple[str, ...] = field(default=COLUMNS, init=False)
    operations: tuple[Operation, ...] = field(default=(), init=False)
    slots: tuple[CorrectionSlot, ...] = field(default=(), init=False)

    @property
    def samples_per_step(self) -> int:
        return self.vehicle.rows

    @property
    def outputs(self) -> tuple[Output, ...]:
        """``track`` (east, north, up of the site, m) and ``attitude``."""
        return (track_output(), determined_output())

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        """The layout of a row; see `reckoning`."""
        del computed
        return reckoning.VARIABLES

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        """Every variable at the start."""
        return unpacked(reckoning.VARIABLES, self.bind(ProviderSettings(frozenset())).initial_row(initial))

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        """The given attitude, the velocity there, and the position: of a simulated record where it really is.

        Raises
        ------
        DataError
            No attitude is given.
        """
        if given is None:
            hint = "initial_attitude: {kind: sins_odometer.aligned, result: results/aligned/result.nc}"
            raise DataError("dead reckoning begins with a known attitude, and none is given", hint=hint)
        moving = self.vehicle.moving_start(given, record)
        position = np.array(self.position)
        if record.truth is not None and "track" in record.truth.values and moving.time is not None:
            row = int(np.argmin(np.abs(record.truth.time - moving.time)))
            position = np.asarray(record.truth.values["track"])[row]
        return replace(moving, values={**moving.values, "track": position})

    def bind(self, settings: ProviderSettings) -> BoundReckoning:
        """The pure functions."""
        del settings
        return BoundReckoning(self.vehicle, self.vehicle.params(transport=True))


@dataclass(frozen=True, slots=True, eq=False)
class BoundReckoning(BoundVehicle):
    """The provider as pure functions on the flat arrays of `reckoning`."""

    n_state: int = field(default=reckoning.N_STATE, init=False)
    compiled: CompiledScan | None = field(
        default=CompiledScan("estimfw_sins_odometer.compiled", "reckoning_step", "keep"), init=False
    )

    def initial_state(self, initial: InitialNominal) -> FloatArray:
        """State (..., 18)."""
        names = ("track", "velocity_b", "gyro_bias_b")
        triads = [np.asarray(initial.values.get(name, np.zeros(3)), dtype=float) for name in names]
        return reckoning.initial(np.asarray(initial.values["C_bn"], dtype=float), *triads)

    def initial_row(self, initial: InitialNominal) -> FloatArray:
        """Row (..., 15) at the start."""
        state = self.initial_state(initial)
        C = state[..., :9].reshape(*state.shape[:-1], 3, 3)
        return reckoning.row_of(C, state[..., 9:12], state[..., 12:15])

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New state, process row, end row."""
        return reckoning.step(state, sample, self.params)

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        """Nothing can be corrected."""
        del delta
        return state.copy()


def track_value(estimates: Mapping[str, FloatArray], nominal: Mapping[str, FloatArray]) -> FloatArray:
    """East, north, up (..., 3) m."""
    del estimates
    return nominal["track"]


def true_track(truth: Mapping[str, FloatArray]) -> FloatArray:
    """East, north, up (..., 3) m."""
    return truth["track"]


def track_output() -> Output:
    """The output ``track``."""
    return Output(
        name="track",
        components=("east", "north", "up"),
        units=("m",) * 3,
        display_units=("m",) * 3,
        value=track_value,
        jacobian=(),
        needs=("track",),
        truth=true_track,
    )


def dead_reckoning(cfg: DeadReckoningConfig, site: Site | None) -> DeadReckoning:
    """The provider that a config describes."""
    return DeadReckoning(vehicle_of(cfg, cfg.kind, site), cfg.position)
