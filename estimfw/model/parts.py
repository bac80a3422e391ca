"""The parts of a model: state blocks, process terms, noise inputs, known inputs, measurements, outputs.

All are values: frozen, hashable, picklable, equal when equal. A part refers to others by name. Coefficients are written
for full triads in the frame in which they act; where a block lives in another frame, the model inserts the rotation, then
selects the axes that live.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from estimfw.model.derived import CompiledFunction, DerivedVariable, HeldArgument
from estimfw.model.dynamics import KnownInput, NoiseInput, ProcessTerm, StateBlock
from estimfw.model.frame import Frame
from estimfw.model.observation import Measurement, MeasurementTerm, Output

__all__ = [
    "BlockParts",
    "CompiledFunction",
    "DerivedVariable",
    "HeldArgument",
    "KnownInput",
    "Measurement",
    "MeasurementTerm",
    "NoiseInput",
    "Output",
    "ProcessParts",
    "ProcessTerm",
    "StateBlock",
]


@dataclass(frozen=True, slots=True)
class BlockParts:
    """What a block component brings: the block, its prior, and the dynamics that are its own.

    ``mean`` and ``covariance`` (SI, SI^2) are over all axes. ``frames`` are those that it and its terms name.
    """

    block: StateBlock
    covariance: tuple[tuple[float, ...], ...]
    mean: tuple[float, ...]
    terms: tuple[ProcessTerm, ...] = ()
    noises: tuple[NoiseInput, ...] = ()
    frames: tuple[Frame, ...] = ()
    outputs: tuple[Output, ...] = ()
    derived: tuple[DerivedVariable, ...] = ()


@dataclass(frozen=True, slots=True)
class ProcessParts:
    """What a process component brings."""

    terms: tuple[ProcessTerm, ...]
    noises: tuple[NoiseInput, ...] = ()
    frames: tuple[Frame, ...] = ()
    derived: tuple[DerivedVariable, ...] = field(default=())
