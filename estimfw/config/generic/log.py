"""Measurements that were logged: one file a stream, read for the columns that the measurements name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from estimfw.config.generic.log_stream import LogStreamConfig, read_stream
from estimfw.config.generic.log_truth import LogTruthConfig, read_truth
from estimfw.config.types import Identifier, Settings, Site
from estimfw.config.wanted_columns import Wanted
from estimfw.data.record import Event, Record, Stream, Truth
from estimfw.errors import ConfigError
from estimfw.model.nominal import InitialNominal
from estimfw.spelling import did_you_mean

__all__ = ["LogConfig", "LogSource", "log"]


class LogConfig(Settings):
    """``streams`` holds one file for each stream that the measurements read (left out of a measurement: its own name).

    With ``truth`` the result tells errors too.
    """

    kind: Literal["log"]
    streams: Annotated[
        dict[Identifier, LogStreamConfig], Field(min_length=1, description="a file for each, by the name of the stream")
    ]
    truth: Annotated[
        str | LogTruthConfig | None,
        Field(description="what really was, where that is known: an archive such as simulate writes, or a table"),
    ] = None


@dataclass(frozen=True, slots=True)
class LogSource:
    """Files, and what to do with them; ``load_wanted`` reads them anew each time."""

    streams: Mapping[str, LogStreamConfig]
    truth: str | LogTruthConfig | None = None

    def load_wanted(self, wanted: Wanted) -> Record:
        """The record: a stream for each file, with the columns that are wanted of it, in SI.

        Raises
        ------
        DataError
            A file that cannot be read or trusted.
        ConfigError
            A unit for a column that nothing reads, or one of the wrong dimension.
        """
        streams: dict[str, Stream] = {}
        events: list[Event] = []
        files: dict[str, object] = {}
        for name, cfg in self.streams.items():
            needed = wanted.get(name, {})
            if not needed:
                events.append(Event(float("nan"), name, "unused", "nothing reads this stream"))
                continue
            try:
                streams[name], found, files[name] = read_stream(name, cfg, needed)
            except ConfigError as error:
                error.within = ("streams", name, *error.within)
                raise
            events.extend(found)
        if not streams:
            read = sorted(wanted)
            own = next(iter(self.streams))
            near = f"{did_you_mean(own, read)}; or give a measurement `stream: {own}`"
            raise ConfigError("nothing reads any of the streams", hint=near, within=("streams",))
        truth, told = self._truth()
        return Record(streams, truth, tuple(events), attributes={"source": "log", "files": files, **told})

    def _truth(self) -> tuple[Truth | None, dict[str, object]]:
        """What really was, and where that stands."""
        if self.truth is None:
            return None, {}
        try:
            truth, facts = read_truth(self.truth)
        except ConfigError as error:
            error.within = ("truth", *error.within)
            raise
        return truth, {"truth": facts}


def log(cfg: LogConfig, site: Site | None, initial: InitialNominal | None) -> LogSource:
    """The source; it depends neither on the place nor on the start."""
    del site, initial
    return LogSource(cfg.streams, cfg.truth)
