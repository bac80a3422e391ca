"""``jump_limit``: readings that cannot be, such as the speed of a slipping wheel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from estimfw.config.generic.preprocessing.free_quantity import FreeQuantity, times_second
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Names, Settings, Site, non_negative_quantity
from estimfw.config.wanted_columns import Wanted, with_columns
from estimfw.data.preprocessing.jumps import JumpLimit, without_jumps
from estimfw.data.preprocessing.rows import stream_of
from estimfw.data.record import Record
from estimfw.units import Quantity, parse_unit

__all__ = ["JumpLimitConfig", "LimitedJumps", "jump_limit"]


class JumpLimitConfig(Settings):
    """After an impossible step readings are left out until one is there that the last good one can have become.

    A lasting change is believed in the end. With ``longest`` all readings between a jump and a jump back are left out; with
    ``window`` means are judged, for a speed made of coarse pulses. A heading begins anew: ``period: 360 deg``.
    """

    kind: Literal["jump_limit"]
    stream: Annotated[str, Field(description="stream that is judged")]
    columns: Annotated[Names, Field(min_length=1, description="columns, each by itself")]
    rate: Annotated[
        Quantity, FreeQuantity(("5 m/s^2", "90 deg/s^2")), Field(description="largest possible rate of change")
    ]
    tolerance: Annotated[
        Quantity | None,
        FreeQuantity(("0.3 m/s",)),
        Field(description="by which a reading may be off without any change (left out: 0)"),
    ] = None
    window: Annotated[
        float, non_negative_quantity("s"), Field(description="over which readings are averaged before they are judged")
    ] = 0.0
    longest: Annotated[
        float, non_negative_quantity("s"), Field(description="a jump back within this time spoils all readings between")
    ] = 0.0
    period: Annotated[
        Quantity | None,
        FreeQuantity(("360 deg",)),
        Field(description="after which a reading begins anew, such as a heading (left out: never)"),
    ] = None

    @model_validator(mode="after")
    def _one_dimension(self) -> Self:
        unit = times_second(self.rate.unit.si_text, 1)
        for key, own in (("tolerance", self.tolerance), ("period", self.period)):
            if own is not None and own.unit.dimension != parse_unit(unit).dimension:
                refuse(
                    f"`{key}` is in {own.unit.si_text}, `rate` in {self.rate.unit.si_text}",
                    f"a {key} in {unit} is due",
                    key,
                )
        return self


@dataclass(frozen=True, slots=True)
class LimitedJumps:
    """Columns and their limit; ``unit`` is that of the columns, ``shown`` that of the rate."""

    stream: str
    columns: tuple[str, ...]
    limit: JumpLimit
    unit: str
    shown: str

    def needs(self, wanted: Wanted) -> Wanted:
        """The same columns, in the unit of the limit."""
        return with_columns(wanted, self.stream, dict.fromkeys(self.columns, self.unit), "rate")

    def apply(self, record: Record) -> Record:
        """The record without what cannot be, and events for it."""
        made, events = without_jumps(stream_of(record, self.stream), self.columns, self.limit, self.shown)
        return replace(record, streams={**record.streams, self.stream: made}, events=(*record.events, *events))


def jump_limit(name: str, cfg: JumpLimitConfig, site: Site | None) -> LimitedJumps:
    """The component; neither its name nor the place matters."""
    del name, site
    tolerance = cfg.tolerance.value if cfg.tolerance is not None else 0.0
    period = cfg.period.value if cfg.period is not None else None
    limit = JumpLimit(cfg.rate.value, tolerance, cfg.window, cfg.longest, period)
    unit = cfg.rate.unit.si_text
    return LimitedJumps(cfg.stream, cfg.columns, limit, times_second(unit, 1), unit)
