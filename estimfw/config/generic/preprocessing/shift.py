"""``shift``: the clock of a stream turned into the record's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from estimfw.config.types import Settings, Site, quantity
from estimfw.data.preprocessing.online import Layouts, OnlineShift
from estimfw.data.preprocessing.rows import stream_of
from estimfw.data.preprocessing.shift import Clock, shifted
from estimfw.data.record import Record

__all__ = ["Shift", "ShiftConfig", "shift"]


class ShiftConfig(Settings):
    """Stamps become instants of the record: t = (stamp - latency - offset + drift since) / (1 + drift)."""

    kind: Literal["shift"]
    stream: Annotated[str, Field(description="stream whose stamps are corrected")]
    latency: Annotated[float, quantity("s", examples=("50 ms",)), Field(description="readings are stamped so late")] = (
        0.0
    )
    offset: Annotated[
        float, quantity("s", examples=("0.2 s", "-1 s")), Field(description="the sensor's clock is ahead by this")
    ] = 0.0
    drift: Annotated[
        float,
        quantity("1", minimum="-0.1", maximum="0.1", examples=("20 ppm",)),
        Field(description="the sensor's clock gains this"),
    ] = 0.0
    since: Annotated[float, quantity("s"), Field(description="instant at which the offset holds")] = 0.0


@dataclass(frozen=True, slots=True)
class Shift:
    """A stream and its clock."""

    stream: str
    clock: Clock

    def apply(self, record: Record) -> Record:
        """The record with the stream on its clock; DataError if there is no such stream."""
        made = shifted(stream_of(record, self.stream), self.clock)
        return replace(record, streams={**record.streams, self.stream: made})

    def online(self, layouts: Layouts) -> OnlineShift:
        """The same in a session."""
        return OnlineShift(layouts, self.stream, self.clock)


def shift(name: str, cfg: ShiftConfig, site: Site | None) -> Shift:
    """The component; neither its name nor the place matters."""
    del name, site
    return Shift(cfg.stream, Clock(cfg.latency, cfg.offset, cfg.drift, cfg.since))
