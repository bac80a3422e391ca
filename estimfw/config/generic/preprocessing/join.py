"""``join``: columns of one stream put onto the stamps of another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from estimfw.config.generic.preprocessing.free_quantity import times_second
from estimfw.config.types import Settings, Site, positive_quantity
from estimfw.config.wanted_columns import Wanted, with_columns, without_columns
from estimfw.data.preprocessing.joining import Joining, Method, joined
from estimfw.data.preprocessing.online import Layouts
from estimfw.data.preprocessing.online_join import OnlineJoin
from estimfw.data.preprocessing.rows import stream_of
from estimfw.data.record import Record

__all__ = ["Join", "JoinConfig", "join"]


class JoinConfig(Settings):
    """The stream ``onto`` gets further columns, and is cut to the time in which the other one has readings.

    Means over intervals stand in the middle of their intervals. Where readings are missing for longer than ``longest_gap`` the
    column is empty, and that is told.
    """

    kind: Literal["join"]
    stream: Annotated[str, Field(description="stream that has the columns")]
    onto: Annotated[str, Field(description="stream that gets them, at its own stamps")]
    columns: Annotated[
        dict[str, str], Field(min_length=1, description="columns: what each is called in the other stream")
    ]
    method: Annotated[
        Method,
        Field(
            description="linear between readings; last one; difference of a cumulative column over each interval; that by time"
        ),
    ] = "linear"
    longest_gap: Annotated[
        Annotated[float, positive_quantity("s")] | None,
        Field(description="readings are trusted that far from one to the next (left out: 1.5 sampling intervals)"),
    ] = None
    missing: Annotated[
        Literal["empty", "refuse"],
        Field(description="over longer gaps: leave the column empty and tell, or end the run"),
    ] = "empty"


@dataclass(frozen=True, slots=True)
class Join:
    """Columns, where they come from and where they go."""

    stream: str
    onto: str
    columns: Mapping[str, str]
    joining: Joining

    def needs(self, wanted: Wanted) -> Wanted:
        """The columns of the one stream, and of the other what it has itself."""
        left, units = without_columns(wanted, self.onto, dict.fromkeys(self.columns.values(), ""), "columns")
        power = 1 if self.joining.method == "rate" else 0
        own = {column: times_second(units[result], power) for column, result in self.columns.items()}
        return with_columns(left, self.stream, own, "columns")

    def apply(self, record: Record) -> Record:
        """The record with the joined stream, and events for what was cut, bridged or missing."""
        made, events = joined(
            stream_of(record, self.onto), stream_of(record, self.stream), dict(self.columns), self.joining
        )
        return replace(record, streams={**record.streams, self.onto: made}, events=(*record.events, *events))

    def online(self, layouts: Layouts) -> OnlineJoin:
        """The same in a session."""
        return OnlineJoin(layouts, self.stream, self.onto, self.columns, self.joining)


def join(name: str, cfg: JoinConfig, site: Site | None) -> Join:
    """The component; neither its name nor the place matters."""
    del name, site
    return Join(cfg.stream, cfg.onto, cfg.columns, Joining(cfg.method, cfg.longest_gap, cfg.missing))
