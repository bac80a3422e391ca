"""``lag_check``: do two sensors tell one motion at one time?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from estimfw.config.types import Settings, Site, positive_quantity
from estimfw.data.preprocessing.lag import LagLimit, lag_events
from estimfw.data.preprocessing.rows import stream_of
from estimfw.data.record import Record
from estimfw.errors import DataError

__all__ = ["LagCheck", "LagCheckConfig", "lag_check"]


class LagCheckConfig(Settings):
    """Changes nothing: a column that lags another one by too much is told with the ``latency`` that cures it, or refused."""

    kind: Literal["lag_check"]
    stream: Annotated[str, Field(description="stream that has both columns, after a join")]
    column: Annotated[str, Field(description="column whose time is in doubt, such as speed")]
    against: Annotated[str, Field(description="column whose time is right, such as dvel_y")]
    relation: Annotated[Literal["rate_of_change", "same"], Field(description="what `against` is of `column`")] = (
        "rate_of_change"
    )
    largest: Annotated[
        float, positive_quantity("s"), Field(description="more, by three of its standard errors, is too much")
    ] = 0.1
    within: Annotated[float, positive_quantity("s"), Field(description="lags are sought up to this")] = 5.0
    least_correlation: Annotated[
        float, Field(gt=0.0, lt=1.0, description="below it nothing can be said, and that is told")
    ] = 0.5
    action: Annotated[Literal["flag", "refuse"], Field(description="refuse: the run ends with an error")] = "flag"


@dataclass(frozen=True, slots=True)
class LagCheck:
    """A stream, its limit, and whether it is refused."""

    stream: str
    limit: LagLimit
    refuse: bool

    def apply(self, record: Record) -> Record:
        """The record with what was found among its events."""
        events = lag_events(stream_of(record, self.stream), self.limit)
        if events and self.refuse:
            raise DataError(f"stream {self.stream!r}: {events[0].text}", hint="`action: flag` runs all the same")
        return replace(record, events=(*record.events, *events))


def lag_check(name: str, cfg: LagCheckConfig, site: Site | None) -> LagCheck:
    """The component; neither its name nor the place matters."""
    del name, site
    limit = LagLimit(cfg.column, cfg.against, cfg.relation, cfg.largest, cfg.within, cfg.least_correlation)
    return LagCheck(cfg.stream, limit, cfg.action == "refuse")
