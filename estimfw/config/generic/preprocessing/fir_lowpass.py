"""``fir_lowpass``: a low-pass filter whose delay is taken out of the stamps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from estimfw.config.quantity_types import refuse
from estimfw.config.types import Identifier, Names, Settings, Site, non_negative_quantity, positive_quantity
from estimfw.config.wanted_columns import Wanted, with_columns, without_columns
from estimfw.data.preprocessing.fir import FirWindow, LowPass, low_passed
from estimfw.data.preprocessing.online import Layouts
from estimfw.data.preprocessing.online_fir import OnlineFir
from estimfw.data.preprocessing.rows import stream_of
from estimfw.data.record import Record

__all__ = ["FirLowPass", "FirLowPassConfig", "fir_lowpass"]


class FirLowPassConfig(Settings):
    """A windowed sinc of linear phase; its output stands at the middle of its window, and is known half a window later.

    The stream becomes one of the filtered columns alone; ``into`` leaves it as it is and makes a stream of that name.
    Rows that no whole window covers are left out. Give ``length`` or ``taps``.
    """

    kind: Literal["fir_lowpass"]
    stream: Annotated[str, Field(description="stream at a constant rate")]
    columns: Annotated[Names, Field(description="columns that are filtered (left out: all)")] = ()
    into: Annotated[Identifier | None, Field(description="stream of the result (left out: the same)")] = None
    cutoff: Annotated[
        float, positive_quantity("Hz", examples=("0.5 Hz",)), Field(description="where half passes, -6 dB")
    ]
    length: Annotated[
        Annotated[float, positive_quantity("s", examples=("4 s",))] | None,
        Field(description="of the window; to the number of taps that puts the output on the stamps"),
    ] = None
    taps: Annotated[
        Annotated[int, Strict(), Field(ge=2, le=100_000)] | None,
        Field(
            description="readings in the window: an even number puts means over intervals on the stamps, an odd one instants"
        ),
    ] = None
    window: Annotated[FirWindow, Field(description="that the sinc is multiplied by")] = "hamming"
    longest_gap: Annotated[
        float,
        non_negative_quantity("s"),
        Field(description="missing readings up to this long are put in, on a straight line"),
    ] = 0.0
    rate: Annotated[
        Annotated[float, positive_quantity("Hz")] | None, Field(description="nominal; the time stamps must show it")
    ] = None

    @model_validator(mode="after")
    def _one_length(self) -> Self:
        if (self.length is None) == (self.taps is None):
            refuse("give `length` or `taps`, one of them", "such as length: 4 s", "cutoff")
        return self


@dataclass(frozen=True, slots=True)
class FirLowPass:
    """Columns of a stream, and their filter."""

    stream: str
    columns: tuple[str, ...]
    into: str
    low_pass: LowPass

    def needs(self, wanted: Wanted) -> Wanted:
        """The same columns, unfiltered."""
        own = self.columns or tuple(wanted.get(self.into, {}))
        left, units = without_columns(wanted, self.into, dict.fromkeys(own, ""), "columns")
        return with_columns(left, self.stream, units, "columns")

    def apply(self, record: Record) -> Record:
        """The record with the filtered stream, and events for rows left out and holes."""
        made, events = low_passed(stream_of(record, self.stream), self.columns, self.low_pass, self.into)
        return replace(record, streams={**record.streams, self.into: made}, events=(*record.events, *events))

    def online(self, layouts: Layouts) -> OnlineFir:
        """The same in a session."""
        return OnlineFir(layouts, self.stream, self.columns, self.low_pass, self.into)


def fir_lowpass(name: str, cfg: FirLowPassConfig, site: Site | None) -> FirLowPass:
    """The component; neither its name nor the place matters."""
    del name, site
    made = LowPass(cfg.cutoff, cfg.length, cfg.taps, cfg.window, cfg.longest_gap, cfg.rate)
    return FirLowPass(cfg.stream, cfg.columns, cfg.into or cfg.stream, made)
