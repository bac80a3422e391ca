"""The settings of the unscented filter."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from estimfw.config.generic.kalman import RecursionConfig
from estimfw.config.generic.smoother import refuse_kalman_only
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Number
from estimfw.estimators.sigma_points import Spread

__all__ = ["UnscentedConfig"]


class UnscentedConfig(RecursionConfig):
    """Sigma points over the error state, each a state of the nominal provider, through its own step and the measurements.

    A nominal provider whose states are corrected needs ``difference``, the inverse of ``correct``. Noises are additive, gates as
    in ``kalman``. The defaults have positive weights only. Honest sigmas and budgets beside it hold to first order.
    """

    kind: Annotated[Literal["unscented"], Field(description="an unscented filter")]
    loop: Annotated[
        Literal["open", "closed"], Field(description="closed: each step's estimate corrects the nominal provider")
    ] = "closed"
    alpha: Annotated[Number, Field(gt=0.0, le=1.0, description="how far the points lie from the mean")] = 1.0
    beta: Annotated[Number, Field(ge=0.0, description="what is known of the distribution; 2: it is normal")] = 2.0
    kappa: Annotated[Number, Field(description="second number of the spread, above minus the number of states")] = 0.0

    @model_validator(mode="before")
    @classmethod
    def _one_kalman_filter_only(cls, data: Any) -> Any:
        return refuse_kalman_only(data, "an unscented filter")

    @model_validator(mode="after")
    def _spreads(self) -> Self:
        if self.kappa <= -1.0:
            refuse(
                f"kappa {self.kappa:g} is negative", "0, or 3 minus the number of states if that is above -1", "kappa"
            )
        return self

    @property
    def covariance(self) -> Literal["ud"]:
        """The form that goes from one step to the next."""
        return "ud"

    @property
    def smoother(self) -> None:
        """There is none."""

    @property
    def kernel(self) -> Literal["numpy"]:
        return "numpy"

    @property
    def spread(self) -> Spread:
        return Spread(self.alpha, self.beta, self.kappa)
