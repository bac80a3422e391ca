"""``stuck``: a sensor that shows one number for too long."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from estimfw.config.types import Names, Number, Settings, Site, positive_quantity
from estimfw.config.wanted_columns import Wanted, with_columns
from estimfw.data.preprocessing.rows import stream_of
from estimfw.data.preprocessing.standstill import without_stuck
from estimfw.data.record import Record

__all__ = ["Stuck", "StuckConfig", "stuck"]


class StuckConfig(Settings):
    """Readings that repeat the one before for longer than ``longest`` are left out, and that is told."""

    kind: Literal["stuck"]
    stream: Annotated[str, Field(description="stream that is judged")]
    columns: Annotated[Names, Field(min_length=1, description="columns, each by itself")]
    longest: Annotated[float, positive_quantity("s"), Field(description="a number may be shown that long")]
    rest: Annotated[
        Number | None, Field(description="what may be shown for ever: 0 of a vehicle that stands (null: nothing)")
    ] = 0.0


@dataclass(frozen=True, slots=True)
class Stuck:
    """Columns, and how long they may show one number."""

    stream: str
    columns: tuple[str, ...]
    longest: float
    rest: float | None

    def needs(self, wanted: Wanted) -> Wanted:
        """The same columns."""
        return with_columns(wanted, self.stream, dict.fromkeys(self.columns, ""), "columns")

    def apply(self, record: Record) -> Record:
        """The record without stuck readings, and events for them."""
        made, events = without_stuck(stream_of(record, self.stream), self.columns, self.longest, self.rest)
        return replace(record, streams={**record.streams, self.stream: made}, events=(*record.events, *events))


def stuck(name: str, cfg: StuckConfig, site: Site | None) -> Stuck:
    """The component; neither its name nor the place matters."""
    del name, site
    return Stuck(cfg.stream, cfg.columns, cfg.longest, cfg.rest)
