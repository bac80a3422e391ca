"""The stages of an estimation as they stand in a config."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from estimfw.config.types import Names, Settings, positive_quantity

__all__ = ["StageConfig"]


class StageConfig(Settings):
    """What is believed, and what is measured, until an instant.

    A state that is neither in ``estimate`` nor in ``consider`` is *held*: believed to be known exactly. It keeps its value and
    has neither covariance nor noise nor gain, until a later stage estimates it: then it enters with what it had when it was
    held, with its prior where it never was estimated.
    """

    name: Annotated[str, Field(min_length=1, max_length=80, description="for people")]
    until: Annotated[
        Annotated[float, positive_quantity("s")] | None,
        Field(description="instant of the record at which it ends; all but the last stage have one"),
    ] = None
    estimate: Annotated[
        Names | None, Field(description="blocks or states that are estimated (left out: all that are not considered)")
    ] = None
    consider: Annotated[
        Names,
        Field(description="blocks or states without gain, whose covariance and correlations are taken into account"),
    ] = ()
    measurements: Annotated[
        Names | None, Field(description="measurements that are used; the others are not due (left out: all)")
    ] = None
