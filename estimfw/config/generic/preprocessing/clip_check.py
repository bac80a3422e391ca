"""``clip_check``: readings at the end of a sensor's range."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from estimfw.config.generic.preprocessing.free_quantity import FreeQuantity
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Names, Number, Settings, Site
from estimfw.config.wanted_columns import Wanted, with_columns
from estimfw.data.preprocessing.clipping import Range, without_clipped
from estimfw.data.preprocessing.rows import stream_of
from estimfw.data.record import Record
from estimfw.units import Quantity

__all__ = ["ClipCheck", "ClipCheckConfig", "clip_check"]


class ClipCheckConfig(Settings):
    """Readings at an end of the range, or beyond, say no more than that the quantity is there or farther out.

    Give the range, or ``repeated`` where it is not known. ``then: flag`` is for a stream that may not have holes, such as a known
    input: the readings stay, and are told. The filter's noise is not raised for them.
    """

    kind: Literal["clip_check"]
    stream: Annotated[str, Field(description="stream that is judged")]
    columns: Annotated[Names, Field(min_length=1, description="columns, each by itself")]
    lowest: Annotated[
        Quantity | None,
        FreeQuantity(("-40 m/s", "-300 deg/s"), signed=True),
        Field(description="lower end of the range"),
    ] = None
    highest: Annotated[
        Quantity | None, FreeQuantity(("40 m/s", "300 deg/s"), signed=True), Field(description="upper end of the range")
    ] = None
    repeated: Annotated[
        Annotated[int, Strict(), Field(ge=2)] | None,
        Field(description="the record's largest or smallest reading, so many times in a row, is taken for clipped"),
    ] = None
    rest: Annotated[
        Number | None, Field(description="what may be repeated: 0 of a vehicle that stands (null: nothing)")
    ] = 0.0
    then: Annotated[
        Literal["leave_out", "flag"],
        Field(description="clipped readings are missing, or used as they are; told anyway"),
    ] = "leave_out"

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.lowest is None and self.highest is None and self.repeated is None:
            refuse("nothing says where the sensor clips", "give `lowest` and `highest`, or `repeated`")
        if self.lowest is not None and self.highest is not None:
            if self.lowest.unit.dimension != self.highest.unit.dimension:
                text = f"`lowest` is in {self.lowest.unit.si_text}, `highest` in {self.highest.unit.si_text}"
                refuse(text, "they bound one quantity", "lowest")
            if not self.lowest.value < self.highest.value:
                refuse("`lowest` is not below `highest`", "the lower end first", "lowest")
        return self


@dataclass(frozen=True, slots=True)
class ClipCheck:
    """Columns, their range in SI, the unit of it (empty: any), and whether clipped readings are left out."""

    stream: str
    columns: tuple[str, ...]
    limit: Range
    unit: str
    leave_out: bool

    def needs(self, wanted: Wanted) -> Wanted:
        """The same columns, in the unit of the range."""
        return with_columns(
            wanted,
            self.stream,
            dict.fromkeys(self.columns, self.unit),
            "highest" if self.limit.highest is not None else "lowest",
        )

    def apply(self, record: Record) -> Record:
        """The record without clipped readings, and events for them."""
        made, events = without_clipped(
            stream_of(record, self.stream), self.columns, self.limit, leave_out=self.leave_out
        )
        return replace(record, streams={**record.streams, self.stream: made}, events=(*record.events, *events))


def clip_check(name: str, cfg: ClipCheckConfig, site: Site | None) -> ClipCheck:
    """The component; neither its name nor the place matters."""
    del name, site
    lowest, highest = ((own.value if own is not None else None) for own in (cfg.lowest, cfg.highest))
    known = cfg.lowest or cfg.highest
    unit = known.unit.si_text if known is not None else ""
    return ClipCheck(
        cfg.stream, cfg.columns, Range(lowest, highest, cfg.repeated, cfg.rest), unit, cfg.then == "leave_out"
    )
