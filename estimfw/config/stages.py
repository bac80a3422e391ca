"""The stages of a config, checked against the model that they are stages of."""

from __future__ import annotations

from collections.abc import Sequence

from estimfw.config.document import Document
from estimfw.config.generic.estimation import Estimation
from estimfw.config.generic.kalman import KalmanConfig
from estimfw.config.generic.stages import StageConfig
from estimfw.config.health import HealthConfig
from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.plan.stages import Stage
from estimfw.policies.drop_states import expand
from estimfw.spelling import did_you_mean

__all__ = ["stages_of"]

PATH = ("estimator", "stages")


def stages_of(
    estimation: Estimation, health: HealthConfig | None, model: Model, document: Document
) -> tuple[Stage, ...]:
    """The stages of an estimator; none where it has none.

    Raises
    ------
    ConfigError
        A name that is not there, instants that do not ascend, a state that is estimated and considered; or the filter is one that
        has no stages: a bank, one that restarts.
    """
    estimator = estimation.filter
    stages = estimator.stages if isinstance(estimator, KalmanConfig) else ()
    if not stages:
        return ()
    _refuse_other_ways(estimation, health, document)
    _refuse_instants(stages, document)
    made: list[Stage] = []
    for i, stage in enumerate(stages):
        try:
            made.append(_stage(stage, model))
        except ConfigError as error:
            document.placed(error, (*PATH, i))
            raise
    return tuple(made)


def _refuse_other_ways(estimation: Estimation, health: HealthConfig | None, document: Document) -> None:
    """What follows one belief all along, or would go back to the prior."""
    estimator = estimation.filter
    if estimation.kind != "kalman":
        raise ConfigError(
            f"an estimator of kind {estimation.kind} has no stages",
            location=document.locate(("estimator",)),
            hint="stages belong to one Kalman filter: estimator: {kind: kalman, stages: [...]}",
        )
    if estimator.restarts:
        raise ConfigError(
            "a filter with stages does not restart: a restart would forget what earlier stages found",
            location=document.locate(("estimator", "restarts")),
            hint="a stage carries on with the estimates; leave `restarts` out",
        )
    if estimator.replay:
        raise ConfigError(
            "a filter with stages does not go back: what a stage began with is not kept",
            location=document.locate(("estimator", "replay")),
            hint="late rows are told and not fused; leave `replay` out",
        )
    if estimator.smoother is not None:
        raise ConfigError(
            "a smoother follows one model, and what is estimated changes from stage to stage",
            location=document.locate(("estimator", "smoother")),
            hint="smooth a filter without stages that estimates all of it",
        )
    if health is not None and health.rejected is not None and health.rejected.then in ("inflate", "restart"):
        raise ConfigError(
            f"health.rejected: `then: {health.rejected.then}` would give a held state its prior back",
            location=document.locate(("health", "rejected", "then")),
            hint="with stages a rejection that lasts is told, or ends the run: then: flag, then: stop",
        )


def _refuse_instants(stages: Sequence[StageConfig], document: Document) -> None:
    *earlier, last = stages
    if last.until is not None:
        raise ConfigError(
            f"stage {last.name!r} is the last one, and goes to the end of the record",
            location=document.locate((*PATH, len(earlier), "until")),
            hint="leave its `until` out, or write the stage that follows",
        )
    before = 0.0
    for i, stage in enumerate(earlier):
        if stage.until is None or stage.until <= before:
            told = (
                "does not say when it ends"
                if stage.until is None
                else f"ends at {stage.until:g} s, not after {before:g} s"
            )
            raise ConfigError(
                f"stage {stage.name!r} {told}",
                location=document.locate((*PATH, i, "until")),
                hint="stages follow each other in time: until: 1 h, then until: 2 h, and the last one without",
            )
        before = stage.until


def _stage(stage: StageConfig, model: Model) -> Stage:
    considered = set(_states(stage.consider, model, "consider"))
    every = [s for s in model.states if s not in considered]
    estimated = set(every if stage.estimate is None else _states(stage.estimate, model, "estimate"))
    both = [s for s in model.states if s in estimated & considered]
    if both:
        raise ConfigError(f"{both[0]} is both estimated and considered", hint="name it once", within=("consider",))
    if not estimated:
        raise ConfigError("nothing is estimated", hint="name a block or a state", within=("estimate",))
    names = [m.name for m in model.measurements]
    for k, name in enumerate(stage.measurements or ()):
        if name not in names:
            raise ConfigError(
                f"there is no measurement {name!r}", hint=did_you_mean(name, names), within=("measurements", k)
            )
    return Stage(
        name=stage.name,
        until=stage.until,
        held=tuple(s not in estimated | considered for s in model.states),
        considered=tuple(s in considered for s in model.states),
        measured=tuple(stage.measurements is None or name in stage.measurements for name in names),
    )


def _states(names: Sequence[str], model: Model, key: str) -> list[str]:
    found: list[str] = []
    for k, name in enumerate(names):
        try:
            found.extend(expand(model, [name]))
        except ConfigError as error:
            error.within = (key, k)
            raise
    return found
