"""The settings of a bank: one filter from several starts."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Strict, Tag, model_validator

from estimfw.config.generic.estimation import Estimation, StartSpread
from estimfw.config.generic.kalman import KalmanConfig
from estimfw.config.generic.smoother import refuse_kalman_only
from estimfw.config.generic.unscented import UnscentedConfig
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Number, Settings
from estimfw.errors import ConfigError
from estimfw.units.quantity import parse_quantity

__all__ = ["BankConfig", "SpreadConfig", "bank"]

MOST_MEMBERS = 1_000


class SpreadConfig(Settings):
    """Starts around one: itself, then ``spacing`` to either side by turns (0, +1, -1, +2, ...), so 8 of 45 deg go all around."""

    quantity: Annotated[
        str,
        Field(
            description="a value of the start such as C_bn, or what the nominal can be corrected for, such as attitude"
        ),
    ]
    axis: Annotated[
        str | Annotated[int, Strict(), Field(ge=0)] | None,
        Field(
            description="of a frame, such as U; of other lists the place, from 0; left out: the quantity is one number"
        ),
    ] = None
    count: Annotated[int, Strict(), Field(ge=1, le=MOST_MEMBERS, description="how many starts")]
    spacing: Annotated[str | Number, Field(description="from one to the next, with its unit, such as 45 deg")]


def _kind(member: object) -> str | None:
    """By which settings a member is read: those of its kind alone, so that a fault is told of these."""
    return str(member.get("kind", "kalman")) if isinstance(member, dict) else getattr(member, "kind", None)


Member = Annotated[
    Annotated[KalmanConfig, Tag("kalman")] | Annotated[UnscentedConfig, Tag("unscented")],
    Discriminator(
        _kind, custom_error_type="member", custom_error_message="settings of the kind kalman or unscented are due"
    ),
]


class BankConfig(Settings):
    """Members share record and plan; the one that explains the measurements best is reported at each epoch.

    Without ``starts`` the start itself has to be several: an ``initial_attitude`` that finds more than one.
    """

    kind: Literal["bank"]
    starts: Annotated[SpreadConfig | None, Field(description="how the starts differ")] = None
    filter: Annotated[Member, Field(description="the settings of each member")] = KalmanConfig()

    @model_validator(mode="before")
    @classmethod
    def _one_kalman_filter_only(cls, data: Any) -> Any:
        return refuse_kalman_only(data, "a bank")

    @model_validator(mode="after")
    def _one_kalman_filter_only_of_a_member(self) -> Self:
        if self.filter.smoother is not None:
            text = "the reported member changes along the run, and there is no way back from one to another"
            refuse(
                "a member of a bank has no smoother",
                f"{text}; smooth the likeliest start by itself",
                ("filter", "smoother"),
            )
        return self


def bank(cfg: BankConfig) -> Estimation:
    """Several filters from several starts."""
    if cfg.starts is None:
        return Estimation("bank", cfg.filter)
    try:
        spacing = parse_quantity(str(cfg.starts.spacing))
    except ConfigError as error:
        error.within = ("starts", "spacing")
        raise
    starts = StartSpread(cfg.starts.quantity, cfg.starts.axis, cfg.starts.count, spacing)
    return Estimation("bank", cfg.filter, starts)
