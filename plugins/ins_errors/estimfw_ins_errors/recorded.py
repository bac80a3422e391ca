"""The nominal provider ``ins_errors.recorded``: what a local-level INS recorded, and, in a closed loop, what it would have."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Settings, Site, non_negative_quantity, positive_quantity, quantity
from estimfw.data.record import SAME, Record, Stream
from estimfw.errors import ConfigError, DataError, NumericalError
from estimfw.model.nominal import (
    CompiledScan,
    CorrectionSlot,
    InitialNominal,
    NominalVariable,
    Operation,
    ProviderSettings,
)
from estimfw_ins_errors import recorded_step
from estimfw_ins_errors.recorded_step import VARIABLES

__all__ = ["BoundRecorded", "Recorded", "RecordedConfig", "recorded"]

FloatArray = NDArray[np.float64]
POINTS = {"start": 0.0, "middle": 0.5, "end": 1.0}
_NEAR_POLE = np.radians(1.0)


class InsColumns(Settings):
    """Names of the columns of the stream."""

    latitude: Annotated[str, Field(description="geodetic, positive north")] = "latitude"
    longitude: Annotated[str | None, Field(description="positive east; null: it is not recorded")] = "longitude"
    velocity_E: Annotated[str, Field(description="velocity to the east")] = "velocity_E"
    velocity_N: Annotated[str, Field(description="velocity to the north")] = "velocity_N"
    heading: Annotated[str, Field(description="clockwise from north")] = "heading"

    @property
    def named(self) -> tuple[str, ...]:
        """In the order of a sample; without the longitude where there is none."""
        every = (self.latitude, self.longitude, self.velocity_E, self.velocity_N, self.heading)
        return tuple(name for name in every if name is not None)

    @property
    def units(self) -> tuple[str, ...]:
        return ("rad", *(("rad",) if self.longitude is not None else ()), "m/s", "m/s", "rad")


class OperatingPoint(Settings):
    """Where the record is taken to begin before it is read: for explain, observe and policies."""

    speed: Annotated[float, non_negative_quantity("m/s"), Field(description="over ground")] = 0.0
    heading: Annotated[float, quantity("rad"), Field(description="clockwise from north")] = 0.0


class RecordedConfig(Settings):
    """``ins_errors.recorded``: the stream ``ins`` of a recorded INS, a step from each of its rows to the next.

    In an open loop it is what was recorded; in a closed loop (``estimator: {loop: closed}``) it is the INS as it would have
    gone on if it had been corrected.
    """

    kind: Literal["ins_errors.recorded"]
    columns: Annotated[InsColumns, Field(description="names of the columns of the stream")] = InsColumns()
    stream: Annotated[str, Field(description="name of the stream")] = "ins"
    gravity: Annotated[float, positive_quantity("m/s^2"), Field(description="of the error model")] = 9.80665
    at_start: Annotated[
        OperatingPoint, Field(description="speed and heading at the start, where no simulation says them")
    ] = OperatingPoint()


@dataclass(frozen=True, slots=True)
class Recorded:
    """The provider, before any data; ``latitude`` (rad) is that of the site, where the config has one."""

    names: InsColumns
    stream: str
    gravity: float
    latitude: float | None
    speed: float
    heading: float
    kind: str = field(default="ins_errors.recorded", init=False)
    operations: tuple[Operation, ...] = field(default=(), init=False)
    samples_per_step: int = field(default=1, init=False)
    slots: tuple[CorrectionSlot, ...] = field(
        default=(
            CorrectionSlot("attitude", "t"),
            CorrectionSlot("velocity", "t"),
            CorrectionSlot("latitude", None),
            CorrectionSlot("longitude", None),
        ),
        init=False,
    )

    @property
    def columns(self) -> tuple[str, ...]:
        return self.names.named

    @property
    def column_units(self) -> tuple[str, ...]:
        """SI units of the columns, for a source that reads a log."""
        return self.names.units

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know though it is no error."""
        if self.latitude is None or np.pi / 2 - abs(self.latitude) > _NEAR_POLE:
            return ()
        return (
            f"latitude {np.degrees(self.latitude):.4g} deg: within a degree of a pole East and North turn fast as one moves",
        )

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        """The layout of a row; see `recorded_step`."""
        del computed
        return VARIABLES

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        """Every variable at the start: of a simulation, else at the site with the speed and heading of ``at_start``.

        Raises
        ------
        ConfigError
            Nobody says a latitude.
        """
        values = dict(initial.values)
        if "latitude" not in values:
            if self.latitude is None:
                raise ConfigError(
                    "nobody says at which latitude the INS starts, on which its error model depends",
                    hint="add `site: {latitude: 45 deg}`: it is for explain, observe and policies; the run reads the record",
                )
            V = self.speed * np.array([np.sin(self.heading), np.cos(self.heading)])
            values |= {"latitude": np.array(self.latitude), "velocity_t": V, "heading": np.array(self.heading)}
        row = self.bind(ProviderSettings(frozenset())).initial_row(InitialNominal(values))
        made, at = dict[str, FloatArray](), 0
        for v in VARIABLES:
            made[v.name] = row[..., at : at + v.size].reshape((*row.shape[:-1], *v.shape))
            at += v.size
        return made

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        """The first row of the record, else the given start.

        Raises
        ------
        DataError
            Neither says it, or the first row is not complete.
        NumericalError
            It lies at a pole, where there is no East.
        """
        if self.stream not in record.streams:
            if given is not None and "latitude" in given.values:
                return given
            raise DataError(
                f"nobody says where the INS starts: the record has no stream {self.stream!r}",
                hint="a session takes start=InitialNominal({'latitude': ..., 'velocity_t': ..., 'heading': ...}) in rad and m/s",
            )
        stream = record.streams[self.stream]
        first = self.recorded(stream, stream.values[:1])[0]
        if not np.all(np.isfinite(first)):
            raise DataError(
                f"stream {self.stream!r}: the first row, which is the start, is not complete", hint="cut it off"
            )
        if abs(first[0]) > np.pi / 2 - 1e-6:
            raise NumericalError(f"the INS starts at latitude {np.degrees(first[0]):g} deg, where there is no East")
        values = {
            "latitude": first[0], "longitude": first[1], "velocity_t": first[2:4], "heading": first[4],
        }  # fmt: skip
        return InitialNominal(values, time=float(stream.time[0]), source="first row of the recorded INS")

    def bind(self, settings: ProviderSettings) -> BoundRecorded:
        """The pure functions, with the process row at the start, middle or end of a step."""
        return BoundRecorded(self, np.array([POINTS[settings.evaluation], self.gravity]))

    def as_recorded(self, record: Record, time: FloatArray) -> dict[str, FloatArray]:
        """The nominal at instants (K,), of the last row until then, without any correction; see `NominalProvider`."""
        stream = record.streams[self.stream]
        rows = np.maximum(np.searchsorted(stream.time, time + SAME, side="right") - 1, 0)
        found = self.recorded(stream, stream.values[rows])
        return {"latitude": found[:, 0], "longitude": found[:, 1], "velocity_t": found[:, 2:4], "heading": found[:, 4]}

    def recorded(self, stream: Stream, values: FloatArray) -> FloatArray:
        """Columns (..., 5) in the order of a sample; a longitude that is not recorded is 0."""
        missing = [c for c in self.columns if c not in stream.columns]
        if missing:
            raise DataError(
                f"the nominal needs the column {missing[0]!r} of stream {self.stream!r}",
                hint=f"the stream has: {', '.join(stream.columns)}; say nominal.columns where they have other names",
            )
        found = values[..., [stream.columns.index(c) for c in self.columns]]
        return np.insert(found, 1, 0.0, axis=-1) if self.names.longitude is None else found


@dataclass(frozen=True, slots=True, eq=False)
class BoundRecorded:
    """The provider as pure functions on the flat arrays of `recorded_step`."""

    provider: Recorded
    params: FloatArray
    n_state: int = field(default=recorded_step.N_STATE, init=False)
    n_sample: int = field(default=recorded_step.N_SAMPLE, init=False)
    compiled: CompiledScan | None = field(
        default=CompiledScan("estimfw_ins_errors.compiled_step", "step", "correct"), init=False
    )

    def initial_state(self, initial: InitialNominal) -> FloatArray:
        """State (..., 12): nothing is corrected yet."""
        v = initial.values
        L = np.asarray(v["latitude"], dtype=float)
        lam = np.broadcast_to(np.asarray(v.get("longitude", 0.0), dtype=float), L.shape)
        recorded = [L[..., None], lam[..., None], np.asarray(v["velocity_t"]), np.asarray(v["heading"])[..., None]]
        return np.concatenate([*recorded, np.zeros((*L.shape, recorded_step.CORRECTION))], axis=-1)

    def initial_row(self, initial: InitialNominal) -> FloatArray:
        """Row (..., 12) at the start, as if neither velocity nor heading changed."""
        state = self.initial_state(initial)
        still = np.zeros((*state.shape[:-1], 2))
        recorded, correction = state[..., : recorded_step.RECORDED], state[..., recorded_step.RECORDED :]
        return recorded_step.row_of(recorded, correction, still, still[..., 0], self.params[1])

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        """Samples (..., steps, 6): length of each step, and the row at its end.

        Raises
        ------
        DataError
            A row is not complete: there is no INS to go on with.
        """
        last = rows[1:] - 1
        period = stream.period if stream.period is not None else 1.0
        before = stream.time[np.maximum(last - 1, 0)]
        dt = np.where(last > 0, stream.time[last] - before, period)
        values = self.provider.recorded(stream, stream.values[..., last, :])
        missing = ~np.all(np.isfinite(values), axis=tuple(i for i in range(values.ndim) if i != values.ndim - 2))
        if np.any(missing):
            at = float(stream.time[last][int(np.argmax(missing))])
            raise DataError(
                f"stream {stream.name!r}: the row at {at:.10g} s is not complete; {int(missing.sum())} of these are not",
                hint="leave such rows out of the log: a step to the next row is made, and the gap is flagged",
            )
        return np.concatenate([np.broadcast_to(dt[:, None], (*values.shape[:-1], 1)), values], axis=-1)

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New state, process row, end row."""
        return recorded_step.step(state, sample, self.params)

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        """Errors delta (..., 12) in the slots are taken out."""
        return recorded_step.correct(state, delta, self.params)

    def difference(self, state: FloatArray, other: FloatArray) -> FloatArray:
        """By which errors (..., 12) the one has to be corrected to be the other."""
        return recorded_step.difference(state, other)


def recorded(cfg: RecordedConfig, site: Site | None) -> Recorded:
    """The provider that a config describes."""
    return Recorded(
        cfg.columns, cfg.stream, cfg.gravity, site.latitude if site is not None else None,
        cfg.at_start.speed, cfg.at_start.heading,
    )  # fmt: skip
