"""The settings of the Kalman filter."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Strict

from estimfw.config.generic.smoother import SmootherConfig
from estimfw.config.generic.stages import StageConfig
from estimfw.config.types import Number, Settings, non_negative_quantity, positive_quantity
from estimfw.plan.discretisation import Discretisation, Method

__all__ = ["DiscretisationConfig", "KalmanConfig", "RecursionConfig", "discretisation"]

Probability = Annotated[Number, Field(gt=0.0, lt=1.0, description="such as 0.999")]


class DiscretisationConfig(Settings):
    """Van Loan (exact for white noise), held_noise (exact for noise that is constant over each step), or series: Phi to
    dt**phi_order, Q to dt**q_order (1: Q = D dt)."""

    method: Annotated[
        Method, Field(description="exact for white noise, exact for noise held over each step, or a series in dt")
    ] = "van_loan"
    phi_order: Annotated[int, Strict(), Field(ge=1, le=12, description="of the series: Phi up to dt to this power")] = 2
    q_order: Annotated[int, Strict(), Field(ge=1, le=12, description="of the series: Q up to dt to this power")] = 1
    evaluation: Annotated[
        Literal["start", "middle", "end"], Field(description="where in a step the dynamics are evaluated")
    ] = "middle"


class RecursionConfig(Settings):
    """What every filter that steps through a record has."""

    discretisation: Annotated[DiscretisationConfig, Field(description="how Phi and Q come from the dynamics")] = (
        DiscretisationConfig()
    )
    gate: Annotated[
        Probability | None, Field(description="chi-square gate of all measurements: fuse what is this probable or more")
    ] = None
    gates: Annotated[
        dict[str, Probability | None], Field(description="by measurement, instead of gate; null: none")
    ] = {}
    restarts: Annotated[
        tuple[Annotated[float, positive_quantity("s")], ...],
        Strict(False),
        Field(description="instants at which the nominal is corrected and the filter starts anew from its prior"),
    ] = ()
    replay: Annotated[
        float,
        non_negative_quantity("s", examples=("5 s",)),
        Field(description="by how much the filter goes back for a row that arrives late; 0: late rows are not fused"),
    ] = 0.0
    covariance_samples: Annotated[
        int, Strict(), Field(ge=2, le=100_000, description="how many full covariances the result keeps")
    ] = 200


class KalmanConfig(RecursionConfig):
    """``gate`` holds for all measurements, ``gates`` for single ones by name; default: no gate.

    ``loop: closed`` corrects the nominal provider at each step and resets the corrected states. ``restarts`` are instants
    (in the record's time) at which the nominal is corrected and the filter starts anew from its prior. ``stages`` say what is
    estimated and measured when, one after the other.
    """

    kind: Annotated[Literal["kalman"], Field(description="a Kalman filter")] = "kalman"
    covariance: Annotated[
        Literal["ud", "joseph"],
        Field(description="form of the covariance: factors U D U', or full with Joseph's update"),
    ] = "ud"
    loop: Annotated[
        Literal["open", "closed"], Field(description="closed: each step's estimate corrects the nominal provider")
    ] = "open"
    kernel: Annotated[
        Literal["auto", "numpy", "numba"],
        Field(description="plain or compiled recursion; auto: by the length of the run"),
    ] = "auto"
    smoother: Annotated[
        SmootherConfig | None, Field(description="estimates of each instant that later data count for too; null: none")
    ] = None
    stages: Annotated[
        tuple[StageConfig, ...],
        Strict(False),
        Field(description="what is estimated and measured when; all of it all the time where there are none"),
    ] = ()


def discretisation(cfg: RecursionConfig) -> Discretisation:
    """How the plan discretises."""
    d = cfg.discretisation
    return Discretisation(d.method, d.phi_order, d.q_order, d.evaluation)
