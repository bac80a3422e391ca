"""Generic process terms and known inputs: ``couple``, ``schedule``."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, Strict, model_validator

from estimfw.config.generic.blocks import Values
from estimfw.config.generic.coefficients import CoefficientText, coefficient_of
from estimfw.config.generic.values import numbers_in, refuse_odd_units, refuse_twice
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Names, Settings, quantity
from estimfw.errors import ConfigError
from estimfw.model.parts import KnownInput, ProcessParts, ProcessTerm

__all__ = ["CoupleConfig", "MeasuredConfig", "ScheduleConfig", "couple", "measured", "schedule"]


class CoupleConfig(Settings):
    """d(target)/dt += coefficient @ source, in SI; the term's label is the name of this entry.

    ``source`` is a block, a noise input or a known input; ``frame`` is where the coefficient acts (left out: the target's).
    """

    kind: Literal["couple"]
    target: Annotated[str, Field(description="block whose rate it is")]
    source: Annotated[str, Field(description="block, noise input or known input that drives it")]
    coefficient: CoefficientText = Field(default=1.0)
    frame: Annotated[str | None, Field(description="frame in which the coefficient acts (left out: the target's)")] = (
        None
    )
    text: Annotated[str, Field(description="what it is, for people")] = ""


def couple(name: str, cfg: CoupleConfig, context: Any) -> ProcessParts:
    """One term."""
    target = context.block(cfg.target)
    columns = context.width(cfg.source)
    try:
        coefficient = coefficient_of(cfg.coefficient, len(target.all_axes), columns, f"{cfg.source} -> {cfg.target}")
    except ValueError as error:
        raise ConfigError(str(error), within=("coefficient",)) from error
    frame = cfg.frame if cfg.frame is not None else target.frame
    return ProcessParts((ProcessTerm(name, cfg.target, cfg.source, coefficient, frame=frame, text=cfg.text),))


class ScheduleStep(Settings):
    """From ``time`` on, the input has this value (one for each axis, or one for all)."""

    time: Annotated[float, quantity("s"), Field(description="from when on, in the record's time")] = 0.0
    value: Annotated[Values, Field(description="one for all axes, or one for each")]


class ScheduleConfig(Settings):
    """A known input that is constant over steps; zero before the first."""

    kind: Literal["schedule"]
    unit: Annotated[str, Field(description="SI unit of the values; 1 is none")] = "1"
    axes: Annotated[Names, Field(description="names of its components (left out: one)")] = ()
    steps: Annotated[
        tuple[ScheduleStep, ...], Strict(False), Field(min_length=1, description="values over time, in its order")
    ]

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        times = [step.time for step in self.steps]
        if times != sorted(times):
            refuse("the steps do not follow each other in time", "sort them by time", "steps")
        self.values()
        return self

    def values(self) -> tuple[tuple[float, ...], ...]:
        count = len(self.axes) or 1
        return tuple(
            numbers_in(step.value, self.unit, count, "value", inside=("steps", i)) for i, step in enumerate(self.steps)
        )


def schedule(name: str, cfg: ScheduleConfig) -> KnownInput:
    return KnownInput(name, cfg.axes or ("",), cfg.unit, tuple(step.time for step in cfg.steps), cfg.values())


class MeasuredConfig(Settings):
    """A known input that is read from a stream: each reading holds until the next; zero before the first."""

    kind: Literal["measured"]
    unit: Annotated[str, Field(description="SI unit of the readings; 1 is none")] = "1"
    axes: Annotated[Names, Field(description="names of its components (left out: one)")] = ()
    stream: Annotated[
        str | None, Field(description="stream that holds the readings (left out: the name of this entry)")
    ] = None
    columns: Annotated[
        Names, Field(description="its columns, one for each axis (left out: the axes, or this entry's name)")
    ] = ()

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        refuse_odd_units(self.unit, "")
        refuse_twice(self.axes, "axes")
        if self.columns and len(self.columns) != (len(self.axes) or 1):
            refuse(f"{len(self.columns)} columns for {len(self.axes) or 1} axes", "one for each", "columns")
        return self


def measured(name: str, cfg: MeasuredConfig) -> KnownInput:
    return KnownInput(
        name, cfg.axes or ("",), cfg.unit, stream=cfg.stream or name, columns=cfg.columns or cfg.axes or (name,)
    )
