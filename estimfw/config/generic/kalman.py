"""The settings of the Kalman filter."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Strict

from estimfw.config.types import Number, Settings, positive_quantity
from estimfw.plan.discretisation import Discretisation

__all__ = ["DiscretisationConfig", "KalmanConfig", "kalman"]

Probability = Annotated[Number, Field(gt=0.0, lt=1.0, description="probability of the chi-square gate, such as 0.999")]


class DiscretisationConfig(Settings):
    """Van Loan (exact), or series: Phi to dt**phi_order, Q to dt**q_order (1: Q = D dt)."""

    method: Literal["van_loan", "series"] = "van_loan"
    phi_order: Annotated[int, Strict(), Field(ge=1, le=12)] = 2
    q_order: Annotated[int, Strict(), Field(ge=1, le=12)] = 1
    evaluation: Literal["start", "middle", "end"] = "middle"


class KalmanConfig(Settings):
    """``gate`` holds for all measurements, ``gates`` for single ones by name; default: no gate.

    ``loop: closed`` corrects the nominal provider at each step and resets the corrected states. ``restarts`` are instants
    (in the record's time) at which the nominal is corrected and the filter starts anew from its prior.
    """

    kind: Literal["kalman"] = "kalman"
    covariance: Literal["ud", "joseph"] = "ud"
    loop: Literal["open", "closed"] = "open"
    kernel: Literal["auto", "numpy", "numba"] = "auto"
    discretisation: DiscretisationConfig = DiscretisationConfig()
    gate: Probability | None = None
    gates: dict[str, Probability | None] = {}
    restarts: Annotated[tuple[Annotated[float, positive_quantity("s")], ...], Strict(False)] = ()
    covariance_samples: Annotated[int, Strict(), Field(ge=2, le=100_000)] = 200


def kalman(cfg: KalmanConfig) -> Discretisation:
    """How the plan discretises."""
    d = cfg.discretisation
    return Discretisation(d.method, d.phi_order, d.q_order, d.evaluation)
