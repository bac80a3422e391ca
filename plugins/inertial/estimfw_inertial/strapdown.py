"""The nominal provider ``inertial.strapdown``: a mechanization that computes what the error model has."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Settings, Site
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError, DataError, NumericalError
from estimfw.model.nominal import (
    AxisMirror,
    CompiledScan,
    CorrectionSlot,
    InitialNominal,
    NominalVariable,
    Operation,
    ProviderSettings,
    TermMirror,
)
from estimfw_inertial import mechanization
from estimfw_inertial.increments import IMU_COLUMNS, imu_samples
from estimfw_inertial.place import SAY_THE_SITE

__all__ = ["BoundStrapdown", "Strapdown", "StrapdownConfig", "strapdown"]

FloatArray = NDArray[np.float64]

_POINTS = {"start": 0.0, "middle": 0.5, "end": 1.0}
_OPERATIONS = (
    Operation("coriolis", TermMirror("coriolis"), text="-(2 omega_ie + omega_en) x V in the velocity"),
    Operation("transport_rate", TermMirror("transport_rate"), text="omega_en, from the computed velocity"),
    Operation("position_update", AxisMirror("position"), text="the position moves with the velocity"),
    Operation("vertical_channel", AxisMirror("velocity", "U"), text="V_U is computed, not held at 0"),
)


class StrapdownConfig(Settings):
    """``inertial.strapdown``: strapdown mechanization in n, from the stream ``imu``."""

    kind: Literal["inertial.strapdown"]
    samples: Annotated[Literal[1, 2], Field(description="sub-samples of a step; 2 compensates coning and sculling")] = 2
    operations: Annotated[
        dict[str, Literal["follow", "on", "off"]],
        Field(
            description="coriolis, transport_rate, position_update, vertical_channel: follow the error model, or force"
        ),
    ] = {}
    allow_mismatch: Annotated[
        bool, Field(description="run although error model and mechanization differ, to show the damage")
    ] = False


@dataclass(frozen=True, slots=True)
class Strapdown:
    """The provider, before any data.

    Attributes
    ----------
    latitude, longitude, height : float, rad and m
        Where it starts, and stays unless ``position_update`` is computed.
    samples_per_step : int
        1 or 2 rows of the stream.
    """

    latitude: float
    longitude: float
    height: float
    samples_per_step: int = 2
    kind: str = field(default="inertial.strapdown", init=False)
    stream: str | None = field(default="imu", init=False)
    columns: tuple[str, ...] = field(default=IMU_COLUMNS, init=False)
    operations: tuple[Operation, ...] = field(default=_OPERATIONS, init=False)
    slots: tuple[CorrectionSlot, ...] = field(
        default=(CorrectionSlot("velocity", "n"), CorrectionSlot("attitude", "n")), init=False
    )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know though it is no error."""
        if np.pi / 2 - abs(self.latitude) > np.radians(1.0):
            return ()
        return (
            f"latitude {np.degrees(self.latitude):.4g} deg: within a degree of a pole the Earth's rate hardly shows north, "
            "and East and North turn fast as one moves",
        )

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        """The layout of a row; see `mechanization`."""
        place: Literal["constant", "varying"] = "varying" if "position_update" in computed else "constant"
        transport: Literal["constant", "varying"] = "varying" if "transport_rate" in computed else "constant"
        return (
            NominalVariable("C_bn", (3, 3), "1", "varying", "C_b^n"),
            NominalVariable("f_n", (3,), "m/s^2", "varying", "f^n"),
            NominalVariable("omega_nb_n", (3,), "rad/s", "varying", r"\omega_{nb}^n"),
            NominalVariable("velocity_n", (3,), "m/s", "varying", "V^n"),
            NominalVariable("earth_rate_n", (3,), "rad/s", place, r"\omega_{ie}^n"),
            NominalVariable("transport_rate_n", (3,), "rad/s", transport, r"\omega_{en}^n"),
            NominalVariable("gravity", (), "m/s^2", place, "g"),
        )

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        """Every variable for a base that stands at the start: f_n = (0, 0, g), V = 0, no turn against n."""
        bound = self.bind(ProviderSettings(frozenset()))
        row = bound.initial_row(InitialNominal({"C_bn": initial.values["C_bn"]}))
        values, at = {}, 0
        for v in self.variables(frozenset()):
            values[v.name] = row[..., at : at + v.size].reshape((*row.shape[:-1], *v.shape))
            at += v.size
        return values

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        """The given start, else the attitude (and velocity) that the record itself tells.

        Raises
        ------
        DataError
            Neither tells an attitude.
        """
        if given is not None:
            return given
        if "C_bn" not in record.initial:
            raise DataError(
                "nobody says what the attitude at the start is",
                hint="add `initial_attitude: {yaw: ..., pitch: ..., roll: ...}` or one found from the record "
                "(`initial_attitude: {kind: inertial.inertial_frame, ...}`), or use a source that knows its start",
            )
        known = {name: record.initial[name] for name in ("C_bn", "velocity_n") if name in record.initial}
        return InitialNominal(known, source="the record")

    def bind(self, settings: ProviderSettings) -> BoundStrapdown:
        """The pure functions, for what is computed."""
        place = mechanization.place_at(np.array(self.latitude), np.array(self.height))
        params = mechanization.pack_params(
            self.samples_per_step, settings.computed, _POINTS[settings.evaluation], place
        )
        return BoundStrapdown(params, (self.latitude, self.longitude, self.height), self.samples_per_step)


@dataclass(frozen=True, slots=True, eq=False)
class BoundStrapdown:
    """The provider bound to the structure of a model; flat arrays as in `mechanization`."""

    params: FloatArray
    position: tuple[float, float, float]
    samples_per_step: int
    n_state: int = field(default=mechanization.N_STATE, init=False)
    compiled: CompiledScan | None = field(
        default=CompiledScan("estimfw_inertial.compiled", "step", "correct"), init=False
    )

    @property
    def n_sample(self) -> int:
        return mechanization.sample_size(self.samples_per_step)

    def initial_state(self, initial: InitialNominal) -> FloatArray:
        """State (..., 15) at the start: its attitude, its velocity (0 if it tells none), the site."""
        C, V = self._attitude_and_velocity(initial)
        position = np.broadcast_to(np.array(self.position), V.shape)
        return np.concatenate([C.reshape((*C.shape[:-2], 9)), V, position], axis=-1)

    def initial_row(self, initial: InitialNominal) -> FloatArray:
        """Row (..., 25) at the start, before any sample: f_n = (0, 0, g), no turn against n."""
        C, V = self._attitude_and_velocity(initial)
        on = mechanization.switches(self.params)
        place = np.broadcast_to(on.place, (*V.shape[:-1], on.place.size))
        force = np.zeros(V.shape)
        force[..., 2] = place[..., 2]
        return mechanization.row_of(C, force, np.zeros(V.shape), V, place, on)

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        """Samples (K, n_sample); see `imu_samples`."""
        return imu_samples(stream, rows, self.samples_per_step)

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New state, process row, end row."""
        return mechanization.step(state, sample, self.params)

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        """V - dV and exp([phi x]) C_bn for delta (..., 6) = (dV, phi), both in n."""
        return mechanization.correct(state, delta, self.params)

    def difference(self, state: FloatArray, other: FloatArray) -> FloatArray:
        """delta (..., 6) = (dV, phi), both in n, with ``correct(state, delta)`` the attitude and velocity of ``other``."""
        return mechanization.difference(state, other)

    def _attitude_and_velocity(self, initial: InitialNominal) -> tuple[FloatArray, FloatArray]:
        C = np.asarray(initial.values["C_bn"], dtype=float)
        V = np.asarray(initial.values.get("velocity_n", np.zeros(3)), dtype=float)
        lead = np.broadcast_shapes(C.shape[:-2], V.shape[:-1])
        V = np.broadcast_to(V, (*lead, 3)).copy()
        if not mechanization.switches(self.params).vertical_channel:
            V[..., 2] = 0.0
        return np.broadcast_to(C, (*lead, 3, 3)), V


def strapdown(cfg: StrapdownConfig, site: Site | None) -> Strapdown:
    """The provider that a config describes.

    Raises
    ------
    ConfigError
        No site.
    NumericalError
        At a pole, where there is no North.
    """
    if site is None:
        raise ConfigError(
            "nominal inertial.strapdown needs the place, for gravity and the Earth's rate",
            hint=SAY_THE_SITE,
        )
    if np.pi / 2 - abs(site.latitude) < 1e-9:
        raise NumericalError(
            f"latitude {np.degrees(site.latitude):g} deg: there is no North at a pole, and no gyrocompass",
            hint="take a place at least a degree away from it",
        )
    return Strapdown(site.latitude, site.longitude, site.height, cfg.samples)
