"""The section ``health``: when a run is told to be sick, and what is done about it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Field, Strict

from estimfw.config.types import Names, Number, Settings, non_negative_quantity
from estimfw.errors import ConfigError
from estimfw.spelling import did_you_mean

__all__ = ["DivergenceConfig", "HealthConfig", "RejectedConfig", "health_fault"]

Longer = Annotated[float, non_negative_quantity("s", examples=("60 s", "2 min"))]


class RejectedConfig(Settings):
    """A measurement that its gate refuses each time it is due.

    ``inflate`` adds the prior covariance of the states that it reads to theirs: what the filter is sure of may be wrong by as
    much as it could be at the start, and the gate opens as far. ``restart`` corrects the nominal and starts anew from the prior.
    Each time it lasts so long again, it is done again.
    """

    times: Annotated[int, Strict(), Field(ge=2, description="at least so many times in a row")] = 10
    longer: Annotated[Longer, Field(description="and over so many s at least")] = 0.0
    then: Annotated[
        Literal["flag", "inflate", "restart", "stop"],
        Field(description="what is done besides telling it; stop ends the run as a numerical error"),
    ] = "flag"
    of: Annotated[Names | None, Field(description="measurements (left out: all that have a gate)")] = None


class DivergenceConfig(Settings):
    """The mean NIS of the last ``epochs`` leaves its chi-square bounds: too large is divergence, too small a hint.

    With a gate an NIS counts for its 99 % quantile at most, so that a few outliers are no divergence; what is
    refused all the time is told as that.
    """

    epochs: Annotated[int, Strict(), Field(ge=2, description="the mean is taken over so many epochs")] = 50
    probability: Annotated[
        Number, Field(gt=0.5, lt=1.0, description="by which a right filter keeps each of the two bounds at an epoch")
    ] = 0.999999
    longer: Annotated[Longer, Field(description="told where it lasts that long")] = 0.0
    strict: Annotated[bool, Strict(), Field(description="divergence ends the run as a numerical error")] = False
    of: Annotated[Names | None, Field(description="measurements (left out: all)")] = None


class HealthConfig(Settings):
    """Without this section both are watched, and told, for measurements that have a gate. Nothing is done in a Monte Carlo."""

    rejected: Annotated[RejectedConfig | None, Field(description="rejection that lasts; null: not watched")] = (
        RejectedConfig()
    )
    divergence: Annotated[DivergenceConfig | None, Field(description="mean NIS out of bounds; null: not watched")] = (
        DivergenceConfig()
    )

    def told_only(self) -> HealthConfig:
        """The same, without anything being done about it."""
        rejected, divergence = self.rejected, self.divergence
        return HealthConfig(
            rejected=rejected.model_copy(update={"then": "flag"}) if rejected is not None else None,
            divergence=divergence.model_copy(update={"strict": False}) if divergence is not None else None,
        )


def health_fault(health: HealthConfig | None, measurements: Mapping[str, bool], estimator: str) -> ConfigError | None:
    """What is wrong with a section; None if nothing is. ``measurements``: whether they have a gate; ``estimator``: its kind."""
    if health is None:
        return None
    if estimator == "decentralised" and health.rejected is not None and health.rejected.then in ("inflate", "restart"):
        return ConfigError(
            "the nodes of a decentralised filter do not agree on a recovery",
            hint="`then: flag` or `then: stop`",
            within=("health", "rejected", "then"),
        )
    return next(_faults(health, list(measurements), {name for name, gate in measurements.items() if gate}), None)


def _faults(health: HealthConfig, names: list[str], gated: set[str]) -> Iterator[ConfigError]:
    for key, part in (("rejected", health.rejected), ("divergence", health.divergence)):
        for i, name in enumerate(part.of or () if part is not None else ()):
            if name not in names:
                yield ConfigError(
                    f"there is no measurement {name!r}",
                    hint=did_you_mean(name, names),
                    within=("health", key, "of", i),
                )
            elif key == "rejected" and name not in gated:
                yield ConfigError(
                    f"measurement {name!r} has no gate, so it is never rejected",
                    hint="give it one: estimator.gate, or estimator.gates",
                    within=("health", key, "of", i),
                )
    if health.rejected is not None and health.rejected.then != "flag" and not gated:
        yield ConfigError(
            "no measurement has a gate, so none is ever rejected",
            hint="give them one: estimator.gate",
            within=("health", "rejected"),
        )
