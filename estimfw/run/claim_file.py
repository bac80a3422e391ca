"""Claims about single runs as data: the filters, what is claimed of their sigmas and errors, and what a page shows of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from estimfw.config.document import Document
from estimfw.config.load import load_document
from estimfw.config.types import Identifier, Names, Number, Settings, non_negative_quantity, positive_quantity
from estimfw.config.validate import validate
from estimfw.errors import ConfigError
from estimfw.spelling import did_you_mean

__all__ = ["Claim", "ClaimFile", "Figure", "Part", "StatedFilter", "read_claim_file"]

Statistic = Literal["sigma", "honest_sigma", "overconfidence", "error", "exponent", "turns", "undetermined"]


class StatedFilter(Settings):
    """A filter that claims are about."""

    config: Annotated[str, Field(description="its config, from the folder of the claims")]
    set: Annotated[Names, Field(description="values set in it, PATH=VALUE each, after those set in all")] = ()
    about: Annotated[str, Field(description="what it is, for people")] = ""


class Part(Settings):
    """A figure, and the bounds between which a part of a claim holds.

    ``sigma``, ``honest_sigma``, ``error`` (its size) and ``overconfidence`` (honest over own sigma) are those at an instant; with
    ``since`` they are over what they were then, and with two filters those of the first over those of the second. ``exponent`` is
    the p with which the sigma gained since the start grows as t^p from ``since`` on, ``turns`` how often the sigma turns from
    growing to shrinking or back, ``undetermined`` how many combinations of states no measurement ever tells.
    """

    text: Annotated[str, Field(description="what is claimed, in words")]
    of: Annotated[Names, Field(description="one filter, or two for a ratio", min_length=1, max_length=2)]
    quantity: Annotated[str, Field(description="a state or an output, such as attitude_error[U]")] = ""
    statistic: Annotated[Statistic, Field(description="what of it")] = "sigma"
    at: Annotated[float, positive_quantity("s"), Field(description="instant; left out: the end")] | None = None
    since: Annotated[float, non_negative_quantity("s"), Field(description="instant before it")] | None = None
    above: Annotated[Number | None, Field(description="holds where the figure is larger")] = None
    below: Annotated[Number | None, Field(description="holds where the figure is smaller")] = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.above is None and self.below is None:
            raise ValueError("a part of a claim needs above, below, or both")
        if (self.statistic == "undetermined") == bool(self.quantity):
            raise ValueError("undetermined is of no quantity, the others need one")
        if self.statistic in ("exponent", "turns") and self.since is None:
            raise ValueError(f"{self.statistic} needs since: it is of a stretch of time")
        if self.statistic in ("exponent", "turns", "undetermined") and len(self.of) != 1:
            raise ValueError(f"{self.statistic} is of one filter")
        return self


class Claim(Settings):
    """What somebody claims: it holds where all parts hold, and partly where some do."""

    text: Annotated[str, Field(description="the claim, as it was made")]
    parts: Annotated[tuple[Part, ...], Strict(False), Field(min_length=1, description="what follows if it is right")]


class Figure(Settings):
    """A part of the page: estimates and sigmas of the states of some filters over time."""

    title: Annotated[str, Field(description="above the charts")]
    of: Annotated[Names, Field(min_length=1, description="filters")]


class ClaimFile(Settings):
    """Filters, claims about them, and figures of a page; see ``estimfw claims``."""

    title: Annotated[str, Field(description="of the page")]
    set: Annotated[Names, Field(description="values set in every filter, PATH=VALUE each")] = ()
    filters: Annotated[dict[Identifier, StatedFilter], Field(min_length=1, description="by the name that claims use")]
    figures: Annotated[tuple[Figure, ...], Strict(False), Field(description="what the page shows")] = ()
    claims: Annotated[tuple[Claim, ...], Strict(False), Field(min_length=1, description="what is judged")]


def read_claim_file(path: Path) -> ClaimFile:
    """The file.

    Raises
    ------
    ConfigError
        With the place of a fault; also where a claim or a figure names a filter that is not there.
    """
    document = load_document(path, begins="title: What is claimed")
    stated = validate(ClaimFile, document.data, document, ())
    for i, claim in enumerate(stated.claims):
        for k, part in enumerate(claim.parts):
            _refuse_strangers(stated, part.of, document, ("claims", i, "parts", k, "of"))
    for i, figure in enumerate(stated.figures):
        _refuse_strangers(stated, figure.of, document, ("figures", i, "of"))
    return stated


def _refuse_strangers(
    stated: ClaimFile, names: tuple[str, ...], document: Document, path: tuple[str | int, ...]
) -> None:
    for name in names:
        if name not in stated.filters:
            raise ConfigError(
                f"no filter here is called {name!r}",
                location=document.locate(path),
                hint=did_you_mean(name, stated.filters),
            )
