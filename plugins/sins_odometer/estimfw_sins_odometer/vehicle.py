"""The vehicle as a config describes it: what the providers of this plugin have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from estimfw_inertial.mounting import MountingConfig, mounting
from estimfw_inertial.place import SAY_THE_SITE
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import PositiveInt, Settings, Site, quantity_vector
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError, DataError, NumericalError
from estimfw.model.nominal import InitialNominal, NominalVariable
from estimfw.plan.layout import NominalLayout
from estimfw_sins_odometer.place import pack_params
from estimfw_sins_odometer.preintegration import ROW_COLUMNS
from estimfw_sins_odometer.samples import odometer_samples, velocity_at

__all__ = ["BoundVehicle", "Vehicle", "VehicleConfig", "unpacked", "vehicle_of"]

FloatArray = NDArray[np.float64]
_Three = tuple[float, float, float]
_LEVER = quantity_vector("m", 3, examples=("[0.1 m, -1.2 m, -0.5 m]",))


class VehicleConfig(Settings):
    """How the stream ``imu`` is cut into steps, and how the sensors sit."""

    rows: Annotated[PositiveInt, Field(description="rows of the stream in a step, an even number")] = 100
    lever_arm: Annotated[_Three, _LEVER, Field(description="from the IMU to the odometer, right, forward, up")] = (
        0.0,
    ) * 3
    mounting: Annotated[MountingConfig | None, Field(description="turn of the IMU against the vehicle")] = None


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


@dataclass(frozen=True, slots=True, eq=False)
class BoundVehicle:
    """What is bound of a vehicle: its samples and its flat parameters."""

    vehicle: Vehicle
    params: FloatArray

    @property
    def n_sample(self) -> int:
        return 1 + ROW_COLUMNS * self.vehicle.rows

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        """Samples (K, n_sample)."""
        return self.vehicle.samples(stream, rows)


def unpacked(variables: Sequence[NominalVariable], row: FloatArray) -> dict[str, FloatArray]:
    """The variables of a row (..., size) by name."""
    return NominalLayout(tuple(variables)).unpack(row)


def vehicle_of(cfg: VehicleConfig, kind: str, site: Site | None) -> Vehicle:
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
    if cfg.rows % 2:
        raise ConfigError(
            f"nominal {kind}: {cfg.rows} rows in a step, an even number is due", hint="two rows make a block"
        )
    if np.pi / 2 - abs(site.latitude) < 1e-9:
        raise NumericalError(f"latitude {np.degrees(site.latitude):g} deg: there is no North at a pole")
    turn = mounting(cfg.mounting).C if cfg.mounting is not None else np.eye(3)
    return Vehicle(site.latitude, site.height, cfg.rows, cfg.lever_arm, tuple(turn.ravel().tolist()))
