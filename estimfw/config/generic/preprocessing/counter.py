"""``counter``: pulse counts turned into a speed or a distance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from estimfw.config.generic.preprocessing.free_quantity import FreeQuantity, times_second
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Identifier, PositiveInt, Settings, Site, positive_quantity
from estimfw.config.wanted_columns import Wanted, with_columns, without_columns
from estimfw.data.preprocessing.counter import Counter, counted
from estimfw.data.preprocessing.online import Layouts
from estimfw.data.preprocessing.online_counter import OnlineCounter
from estimfw.data.preprocessing.rows import stream_of
from estimfw.data.record import Record
from estimfw.units import Quantity, parse_unit

__all__ = ["CountedPulses", "CounterConfig", "counter"]

_SECOND = parse_unit("s")


class CounterConfig(Settings):
    """Counts since a start that may wrap or be reset; what they did follows from the ``fastest`` that the vehicle can do.

    The stream becomes one of the results alone; ``into`` leaves it as it is and makes a stream of that name.
    """

    kind: Literal["counter"]
    stream: Annotated[str, Field(description="stream that holds the counts")]
    columns: Annotated[
        dict[str, str], Field(min_length=1, description="columns of counts: what each is called in the result")
    ]
    into: Annotated[Identifier | None, Field(description="stream of the result (left out: the same)")] = None
    scale: Annotated[
        Quantity, FreeQuantity(("0.04 m", "0.1 deg"), signed=True), Field(description="what one count stands for")
    ]
    output: Annotated[
        Literal["rate", "increment", "count"],
        Field(description="mean rate over each interval, increment over it, or the count without wraps and resets"),
    ] = "rate"
    modulus: Annotated[
        PositiveInt | None, Field(description="counts until it begins anew, 65536 of 16 bits (left out: it never does)")
    ] = None
    fastest: Annotated[
        Quantity | None,
        FreeQuantity(("70 m/s", "720 deg/s")),
        Field(description="largest possible rate: beyond it a step is a wrap, a reset or a fault"),
    ] = None
    direction: Annotated[Literal["up", "both"], Field(description="both: it counts down as well")] = "up"
    rate: Annotated[
        Annotated[float, positive_quantity("Hz")] | None, Field(description="nominal; the time stamps must show it")
    ] = None

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.modulus is not None and self.fastest is None:
            refuse(
                "a counter that wraps needs `fastest`",
                "with the largest possible rate a wrap can be told from a reset, such as fastest: 70 m/s",
                "modulus",
            )
        if self.fastest is not None:
            due = self.scale.unit.dimension
            found = (self.fastest.unit * _SECOND).dimension
            if found != due:
                refuse(
                    f"`fastest` is in {self.fastest.unit.si_text}, `scale` in {self.scale.unit.si_text}",
                    f"a rate in {times_second(self.scale.unit.si_text, -1)} is due",
                    "fastest",
                )
        return self


@dataclass(frozen=True, slots=True)
class CountedPulses:
    """A stream of counts, and what becomes of it; ``unit`` is that of the result."""

    stream: str
    columns: Mapping[str, str]
    into: str
    counter: Counter
    output: Literal["rate", "increment", "count"]
    unit: str

    def needs(self, wanted: Wanted) -> Wanted:
        """Plain counts."""
        left, _ = without_columns(wanted, self.into, dict.fromkeys(self.columns.values(), self.unit), "scale")
        return with_columns(left, self.stream, dict.fromkeys(self.columns, "1"), "columns")

    def apply(self, record: Record) -> Record:
        """The record with the result, and events for all that was no plain count."""
        made, events = counted(stream_of(record, self.stream), dict(self.columns), self.counter, self.output, self.into)
        return replace(record, streams={**record.streams, self.into: made}, events=(*record.events, *events))

    def online(self, layouts: Layouts) -> OnlineCounter:
        """The same in a session."""
        return OnlineCounter(layouts, self.stream, self.columns, self.counter, self.output, self.into)


def counter(name: str, cfg: CounterConfig, site: Site | None) -> CountedPulses:
    """The component; neither its name nor the place matters."""
    del name, site
    made = Counter(
        scale=cfg.scale.value,
        modulus=float(cfg.modulus) if cfg.modulus is not None else None,
        fastest=cfg.fastest.value if cfg.fastest is not None else None,
        both=cfg.direction == "both",
        rate=cfg.rate,
    )
    unit = times_second(cfg.scale.unit.si_text, -1 if cfg.output == "rate" else 0)
    return CountedPulses(cfg.stream, cfg.columns, cfg.into or cfg.stream, made, cfg.output, unit)
