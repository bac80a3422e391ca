"""A nominal that nothing drives: named constants, for the whole run or from an instant on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Strict

from estimfw.config.generic.stepped_nominal import SteppedNominal
from estimfw.config.types import Number, Settings, Site, quantity
from estimfw.data.record import Record
from estimfw.model.nominal import CorrectionSlot, InitialNominal, NominalVariable, Operation, ProviderSettings

__all__ = [
    "ConstantNominal",
    "ConstantNominalConfig",
    "SteppedNominalConfig",
    "constant_nominal",
    "stepped_nominal",
]

FloatArray = NDArray[np.float64]
Row = Annotated[tuple[Number, ...], Strict(False)]
NamedValues = Annotated[
    dict[str, Number | Row | Annotated[tuple[Row, ...], Strict(False)]],
    Field(description="by name: a number, a list, or a list of rows, in SI"),
]


class ConstantNominalConfig(Settings):
    """``values``: a number, a vector or a matrix (SI) for each variable."""

    kind: Literal["constant"] = "constant"
    values: NamedValues = {}


class NominalStep(Settings):
    """From ``time`` on, the variables have these values."""

    time: Annotated[float, quantity("s"), Field(description="from when on, in the record's time")] = 0.0
    values: NamedValues


class SteppedNominalConfig(Settings):
    """Constants by step: all variables in each; the values of the first step hold before it, too."""

    kind: Literal["stepped"]
    steps: Annotated[
        tuple[NominalStep, ...], Strict(False), Field(min_length=1, description="values over time, in its order")
    ]


@dataclass(frozen=True, slots=True)
class ConstantNominal:
    """Constants by name; reads no stream, corrects nothing."""

    names: tuple[str, ...] = ()
    arrays: tuple[tuple[tuple[int, ...], tuple[float, ...]], ...] = ()
    kind: str = "constant"
    operations: tuple[Operation, ...] = ()
    slots: tuple[CorrectionSlot, ...] = ()
    stream: str | None = None
    columns: tuple[str, ...] = ()
    samples_per_step: int = 1

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        return tuple(NominalVariable(n, s, "SI", "constant") for n, (s, _) in zip(self.names, self.arrays, strict=True))

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        return {n: np.array(v).reshape(s) for n, (s, v) in zip(self.names, self.arrays, strict=True)}

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        """The constants, at the instant that the record names as its start (``initial["time"]``), if it does."""
        time = float(record.initial["time"]) if "time" in record.initial else None
        return InitialNominal(self.reference(InitialNominal({})), time=time, source="constants")

    def bind(self, settings: ProviderSettings) -> None:
        return None


def constant_nominal(cfg: ConstantNominalConfig, site: Site | None) -> ConstantNominal:
    arrays = {name: np.asarray(value, dtype=float) for name, value in cfg.values.items()}
    packed = tuple((a.shape, tuple(float(x) for x in a.ravel())) for a in arrays.values())
    return ConstantNominal(tuple(arrays), packed)


def stepped_nominal(cfg: SteppedNominalConfig, site: Site | None) -> SteppedNominal:
    """ConfigError where the steps are out of order, or do not have the same variables."""
    return SteppedNominal.of("stepped", [(step.time, step.values) for step in cfg.steps])
