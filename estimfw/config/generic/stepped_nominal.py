"""A nominal that changes in steps: constants until an instant, others from then on. No stream drives it, time alone does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.data.record import SAME, Record, Stream
from estimfw.errors import ConfigError
from estimfw.model.nominal import (
    CompiledScan,
    CorrectionSlot,
    InitialNominal,
    NominalVariable,
    Operation,
    ProviderSettings,
)

__all__ = ["BoundSchedule", "SteppedNominal"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SteppedNominal:
    """Values by step; corrects nothing. Plugins make theirs by `of`.

    Attributes
    ----------
    layout : tuple of NominalVariable
    times : tuple of float, s
        When each step begins; the first holds before, too.
    rows : tuple of tuple of float
        For each step the row that holds for the intervals in it. A measurement at the instant of a change belongs to the interval
        that ends there.
    """

    kind: str
    layout: tuple[NominalVariable, ...]
    times: tuple[float, ...]
    rows: tuple[tuple[float, ...], ...]
    warnings: tuple[str, ...] = ()
    operations: tuple[Operation, ...] = field(default=(), init=False)
    slots: tuple[CorrectionSlot, ...] = field(default=(), init=False)
    stream: str | None = field(default=None, init=False)
    columns: tuple[str, ...] = field(default=(), init=False)
    samples_per_step: int = field(default=1, init=False)

    @classmethod
    def of(
        cls,
        kind: str,
        steps: Sequence[tuple[float, Mapping[str, ArrayLike]]],
        symbols: Mapping[str, tuple[str, str]] | None = None,
        warnings: tuple[str, ...] = (),
    ) -> SteppedNominal:
        """From (instant in s, values by name) of each step, in order; what is the same in all of them is a constant.

        Parameters
        ----------
        kind : str
            Of the component.
        steps : sequence of (float, mapping of str to array)
            The same names and shapes in each.
        symbols : mapping of str to (unit, LaTeX)
            Of variables, for people.
        warnings : tuple of str
            What a user should know though it is no error.

        Raises
        ------
        ConfigError
            Steps out of order, or with other variables or shapes than the first.
        """
        times = tuple(float(time) for time, _ in steps)
        if any(later - before <= SAME for before, later in pairwise(times)):
            raise ConfigError(f"nominal {kind}: the steps do not follow each other in time", hint="sort them by time")
        arrays = [{name: np.asarray(value, dtype=float) for name, value in values.items()} for _, values in steps]
        shapes = {name: value.shape for name, value in arrays[0].items()}
        for time, own in zip(times, arrays, strict=True):
            if {name: value.shape for name, value in own.items()} != shapes:
                hint = f"each step has {', '.join(f'{name} {shape}' for name, shape in shapes.items())}"
                raise ConfigError(
                    f"nominal {kind}: the step at {time:g} s has other variables than the first", hint=hint
                )
        known = dict(symbols or {})
        layout = tuple(_variable(name, [own[name] for own in arrays], *known.get(name, ("SI", ""))) for name in shapes)
        rows = tuple(tuple(float(x) for v in layout for x in np.ravel(own[v.name])) for own in arrays)
        return cls(kind, layout, times, rows, warnings)

    @property
    def instants(self) -> tuple[float, ...]:
        """When it changes, s: ends of steps of the filter."""
        return self.times[1:]

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        return self.layout

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        """The values of the first step."""
        found, at = {}, 0
        for v in self.layout:
            found[v.name] = np.array(self.rows[0][at : at + v.size]).reshape(v.shape)
            at += v.size
        return found

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        """At the instant that the record names as its start (``initial["time"]``), if it does."""
        time = float(record.initial["time"]) if "time" in record.initial else None
        return InitialNominal(self.reference(InitialNominal({})), time=time, source="constants")

    def bind(self, settings: ProviderSettings) -> BoundSchedule | None:
        """None where it has one step: then nothing drives it."""
        return BoundSchedule(np.array(self.times), np.array(self.rows)) if self.instants else None


def _variable(name: str, values: Sequence[FloatArray], unit: str, latex: str) -> NominalVariable:
    """With a value for each step."""
    same = all(np.array_equal(values[0], value) for value in values)
    return NominalVariable(name, values[0].shape, unit, "constant" if same else "stepped", latex)


@dataclass(frozen=True, slots=True, eq=False)
class BoundSchedule:
    """Rows (S, size) that hold from times (S,) s on; a sample is a row. It has no state."""

    times: FloatArray
    rows: FloatArray
    params: FloatArray = field(default_factory=lambda: np.zeros(1), init=False)
    n_state: int = field(default=0, init=False)
    compiled: CompiledScan | None = field(
        default=CompiledScan("estimfw.kernels.scheduled", "step", "correct"), init=False
    )

    @property
    def n_sample(self) -> int:
        return int(self.rows.shape[1])

    def initial_state(self, initial: InitialNominal) -> FloatArray:
        return np.zeros(0)

    def initial_row(self, initial: InitialNominal) -> FloatArray:
        """The row that holds at the start."""
        return self._from(np.array(self.times[0] if initial.time is None else initial.time))

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        raise TypeError("no stream drives a schedule")

    def samples_between(self, begin: FloatArray, end: FloatArray) -> FloatArray:
        """Rows (K, size) for the intervals from begin (K,) to end (K,), s."""
        return self._from(begin)

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The sample is the row, for the whole interval and at its end."""
        return state, sample, sample

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        return state

    def _from(self, time: FloatArray) -> FloatArray:
        return self.rows[np.maximum(np.searchsorted(self.times, time + SAME, side="right") - 1, 0)]
