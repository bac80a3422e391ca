"""The settings of a determination: what the nominal provider computes, step by step, without states and without a covariance."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from estimfw.config.filter_config import FilterConfig
from estimfw.config.generic.estimation import Estimation
from estimfw.config.generic.kalman import KalmanConfig
from estimfw.config.generic.smoother import refuse_kalman_only
from estimfw.config.types import Settings
from estimfw.errors import ConfigError

__all__ = ["DeterminationConfig", "determination", "misplaced_section"]

#: Sections that say something of states.
OF_STATES = ("blocks", "process", "inputs", "measurements", "prior", "policies", "health")


class DeterminationConfig(Settings):
    """The provider's ``outputs`` are the result; there are no ``blocks``, so nothing has a sigma."""

    kind: Literal["determination"]
    kernel: Annotated[
        Literal["auto", "numpy", "numba"],
        Field(description="plain or compiled provider; auto: by the length of the run"),
    ] = "auto"

    @model_validator(mode="before")
    @classmethod
    def _one_kalman_filter_only(cls, data: Any) -> Any:
        return refuse_kalman_only(data, "a determination")


def determination(cfg: DeterminationConfig) -> Estimation:
    """The recursion of a filter that has no states: what is left of it is the scan of the provider."""
    return Estimation("determination", KalmanConfig(kernel=cfg.kernel))


def misplaced_section(cfg: FilterConfig) -> ConfigError | None:
    """The error for a section about states; None where there is none."""
    found = next((name for name in OF_STATES if getattr(cfg, name)), None)
    if found is None:
        return None
    return ConfigError(
        f"a determination has no states: {found!r} says something of them",
        hint=f"leave out {found!r}, or estimate them: estimator: {{kind: kalman}}",
        within=(found,),
    )
