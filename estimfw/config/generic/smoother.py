"""The settings of a smoother: what of the data after an instant counts for the estimate at it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from estimfw.config.quantity_types import refuse
from estimfw.config.types import Settings, positive_quantity

__all__ = ["FixedIntervalConfig", "FixedLagConfig", "SmootherConfig", "refuse_kalman_only"]


class FixedIntervalConfig(Settings):
    """All data of the record count for each instant (Rauch, Tung and Striebel); a restart cuts the record."""

    kind: Annotated[Literal["fixed_interval"], Field(description="all data of the record count")]


class FixedLagConfig(Settings):
    """For each instant the data up to ``lag`` after it count: what a session knows, so much later."""

    kind: Annotated[Literal["fixed_lag"], Field(description="data up to a lag after an instant count")]
    lag: Annotated[
        float, positive_quantity("s", examples=("60 s", "5 min")), Field(description="how far the data may lie ahead")
    ]


SmootherConfig = Annotated[FixedIntervalConfig | FixedLagConfig, Field(discriminator="kind")]


def refuse_kalman_only(data: Any, kind: str) -> Any:
    """Raise, inside a pydantic validator, for an estimator of a ``kind`` that has neither smoother nor stages."""
    if isinstance(data, dict) and data.get("smoother") is not None:
        refuse(f"{kind} has no smoother", "a smoother goes back over one Kalman filter: kind: kalman", "smoother")
    if isinstance(data, dict) and data.get("stages"):
        refuse(f"{kind} has no stages", "stages say what one Kalman filter believes: kind: kalman", "stages")
    return data
