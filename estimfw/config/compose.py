"""From a config to a composed problem: model, policies applied, provider switched to match, plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.directions import undetectable_directions
from estimfw.config.block_frames import with_frame_axes
from estimfw.config.builder import Builder
from estimfw.config.document import Document
from estimfw.config.exact_quotient import refuse_inexact_quotient
from estimfw.config.filter_config import FilterConfig
from estimfw.config.generic.decentralised import DecentralisedConfig, cut_plan
from estimfw.config.generic.determination import misplaced_section
from estimfw.config.generic.estimation import Estimation, RecursionSettings, StartSpread
from estimfw.config.generic.kalman import discretisation
from estimfw.config.generic.nominal import ConstantNominal
from estimfw.config.generic.values import STATE_BYTES
from estimfw.config.health import health_fault
from estimfw.config.model_context import ModelContext
from estimfw.config.stages import stages_of
from estimfw.config.stepped_frames import refuse_stepped_turns
from estimfw.config.truth import Truth, own_truth
from estimfw.config.validate import validate
from estimfw.config.wanted_columns import Wanted, wanted_columns
from estimfw.data.memory import refuse_too_large
from estimfw.errors import ConfigError
from estimfw.model.build import build_model
from estimfw.model.derived import derived_value
from estimfw.model.model import Model
from estimfw.model.nominal import InitialNominal, NominalProvider, ProviderSettings
from estimfw.model.parts import (
    BlockParts,
    DerivedVariable,
    KnownInput,
    Measurement,
    ProcessParts,
)
from estimfw.plan.equivalence import OperationCheck, settle_operations
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import Plan, make_plan
from estimfw.policies.change import Change, Policy
from estimfw.policies.drop_frame_rotation import turn_name
from estimfw.policies.sequence import apply_policies
from estimfw.registry.registry import Registry
from estimfw.spelling import did_you_mean

__all__ = ["Problem", "compose", "filter_path"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Problem:
    """Everything a run needs but the data.

    Attributes
    ----------
    config : FilterConfig
    document : Document
    full, model : Model
        Before and after the policies.
    policies : tuple of Policy
    changes : tuple of Change
    checks : tuple of OperationCheck
    provider : NominalProvider
    settings : ProviderSettings
    reference : mapping of str to array
        The nominal frozen at the start.
    plan : Plan
    kind : str
        Of the estimator.
    estimator : KalmanConfig, UnscentedConfig or DecentralisedConfig
        How its recursion is done.
    starts : StartSpread or None
        How the starts of a bank differ.
    initial : object or None
        Finds the start (``find``, ``reference``).
    source : object or None
        Makes the record.
    aiding : mapping of str to object
        Further sources, whose streams join the record.
    preprocess : mapping of str to object
        What is done to the record before the filter sees it, in this order.
    wanted : mapping of stream to mapping of column to unit
        What the sources have to bring for measurements, inputs and preprocessing.
    monitors : tuple of objects
    truth : Truth or None
        The truth model beside the filter's own; None where they are the same.
    undetermined : tuple of str
        Combinations of states that the measurements do not determine, at the reference nominal; none where they vary.
    warnings : tuple of str
    owners : mapping of str to str
        By the path of a section (``source``, ``monitors.motion``): the plugin that it comes from.
    """

    config: FilterConfig
    document: Document
    full: Model
    model: Model
    policies: tuple[Policy, ...]
    changes: tuple[Change, ...]
    checks: tuple[OperationCheck, ...]
    provider: NominalProvider | ConstantNominal
    settings: ProviderSettings
    reference: Mapping[str, FloatArray]
    plan: Plan
    kind: str
    estimator: RecursionSettings
    starts: StartSpread | None
    initial: Any
    source: Any
    aiding: Mapping[str, Any]
    preprocess: Mapping[str, Any]
    wanted: Wanted
    monitors: tuple[Any, ...]
    truth: Truth | None
    undetermined: tuple[str, ...]
    warnings: tuple[str, ...]
    owners: Mapping[str, str]


def compose(document: Document, registry: Registry) -> Problem:
    """Build everything but the data.

    Raises
    ------
    ConfigError, PluginError, NumericalError
        With the place in the config.
    """
    cfg = validate(FilterConfig, document.data, document, ())
    build = Builder(document, registry)
    site = cfg.site
    provider = build.make("nominal", cfg.nominal, ("nominal",), site) if cfg.nominal is not None else ConstantNominal()
    initial = _initial(cfg, build, site)
    given = initial.reference() if initial is not None else None
    source = build.make("source", cfg.source, ("source",), site, given) if cfg.source is not None else None
    aiding = {n: build.make("source", s, ("aiding", n), site, given) for n, s in cfg.aiding.items()}
    preprocess = dict(zip(cfg.preprocess, build.named("preprocess", cfg.preprocess, "preprocess", site), strict=True))
    estimation = _estimation(cfg, build)
    full = _model(cfg, build, site, provider)
    reference = _reference(provider, given, source, full.derived)
    policies: list[Policy] = [build.make("policy", p, ("policies", i)) for i, p in enumerate(cfg.policies)]
    model, changes = _apply(policies, full, reference, document)
    checks = _checks(cfg, provider, model, document)
    settings = ProviderSettings(frozenset(c.operation for c in checks if c.computed))
    _stepped_turns(model, provider, settings, document)
    estimator = estimation.filter
    settings = replace(settings, evaluation=discretisation(estimator).evaluation)
    plan = _plan(model, provider, settings, estimator, document)
    _refuse_unknown_gates(estimator, build, plan)
    _exact_quotient(model, plan, provider, settings, document)
    _refuse_health(cfg, plan, estimation.kind, document)
    plan = replace(plan, stages=stages_of(estimation, cfg.health, model, document))
    truth, unpriced = own_truth(full, model, changes, provider, settings.computed, reference, plan)
    return Problem(
        config=cfg, document=document, full=full, model=model, policies=tuple(policies), changes=tuple(changes),
        checks=checks, provider=provider,
        settings=settings, reference=reference, plan=plan, kind=estimation.kind, estimator=estimator,
        starts=estimation.starts, initial=initial, source=source, aiding=aiding, preprocess=preprocess,
        wanted=wanted_columns(plan, preprocess, document, provider),
        monitors=tuple(build.named("monitor", cfg.monitors, "monitors", site)),
        truth=truth,
        undetermined=_undetermined(model, reference, plan),
        warnings=(*getattr(provider, "warnings", ()), *registry_warnings(registry), *unpriced),
        owners=build.owners,
    )  # fmt: skip


def _undetermined(model: Model, reference: Mapping[str, FloatArray], plan: Plan) -> tuple[str, ...]:
    """At the start; nothing is said where a measurement itself changes along the run: what it reads there is not what it will.

    Nor where the dynamics do in steps, as of a platform that is turned so that the second position tells what the first cannot.
    """
    if plan.pace == "stepped" or any(what.startswith("measurement ") for what, _, _ in plan.varying):
        return ()
    return tuple(undetectable_directions(model, reference))


def registry_warnings(registry: Registry) -> tuple[str, ...]:
    """Plugins that could not be loaded: the run goes on without them."""
    return tuple(f"plugin {p.name}: {p.status} ({p.reason})" for p in registry.failed)


def _initial(cfg: FilterConfig, build: Builder, site: Any) -> Any:
    if cfg.initial_attitude is None:
        return None
    kind = str(cfg.nominal.get("kind", "")) if cfg.nominal else ""
    default = f"{kind.partition('.')[0]}.given" if "." in kind else None
    return build.make("initial", cfg.initial_attitude, ("initial_attitude",), site, default=default)


def _reference(
    provider: Any, given: InitialNominal | None, source: Any, derived: tuple[DerivedVariable, ...]
) -> dict[str, FloatArray]:
    values = dict(given.values) if given is not None else {}
    values.update(getattr(source, "start_values", {}))
    if not values and provider.stream is not None:
        values = {"C_bn": np.eye(3)}
    reference: dict[str, FloatArray] = dict(provider.reference(InitialNominal(values)))
    for frame, angle in getattr(source, "turn_angles", {}).items():
        reference[turn_name(frame)] = np.array(float(angle))
    for variable in derived:
        if all(need in reference for need in variable.reads):
            reference[variable.name] = derived_value(variable, reference, ())
    return reference


def _model(cfg: FilterConfig, build: Builder, site: Any, provider: Any) -> Model:
    blocks: list[BlockParts] = []
    for made in build.named("block", cfg.blocks, "blocks", site):
        blocks.extend(made if isinstance(made, tuple) else (made,))
    _refuse_too_many_states(cfg, blocks, build.document)
    blocks = _in_frames(blocks, build.document)
    inputs: list[KnownInput] = build.named("input", cfg.inputs, "inputs")
    by_name = {b.block.name: b.block for b in blocks}
    noises = {n.name: n for b in blocks for n in b.noises}
    process: list[ProcessParts] = []
    for name, entry in cfg.process.items():
        context = ModelContext(site, by_name, noises, {k.name: k for k in inputs})
        process.extend(build.named("process", {name: entry}, "process", context))
        noises |= {n.name: n for n in process[-1].noises}
        build.fits("process", name, process[-1], replace(context, noises=noises).widths)
    context = ModelContext(site, by_name, noises, {k.name: k for k in inputs})
    measurements: list[Measurement] = build.named("measurement", cfg.measurements, "measurements", context)
    for m in measurements:
        build.fits("measurements", m.name, m, context.widths)
        _refuse_zero_noise(m, build.document)
    correlations = {c.between: c.value for c in cfg.prior.correlations} if cfg.prior else {}
    _refuse_unknown_labels(cfg, [label for b in blocks for label in b.block.labels], build.document)
    try:
        outputs = () if blocks else getattr(provider, "outputs", ())
        return build_model(blocks, process, measurements, inputs, correlations, outputs)
    except ConfigError as error:
        build.document.placed(error, () if error.within else ("prior",) if "prior" in error.message else ("blocks",))
        raise


def _in_frames(blocks: list[BlockParts], document: Document) -> list[BlockParts]:
    try:
        return with_frame_axes(blocks)
    except ConfigError as error:
        document.placed(error, ())
        raise


def _refuse_too_many_states(cfg: FilterConfig, blocks: list[BlockParts], document: Document) -> None:
    """Before anything grows with the square of their number."""
    count = sum(len(b.block.axes) for b in blocks)
    kept = (cfg.estimator or {}).get("covariance_samples", 200)
    each = STATE_BYTES + 8.0 * (kept if isinstance(kept, int) else 200)
    try:
        refuse_too_large(each * count * count, f"{count} states", "fewer states, or fewer estimator.covariance_samples")
    except ConfigError as error:
        error.location = document.locate(("blocks",))
        raise


def _refuse_unknown_labels(cfg: FilterConfig, labels: list[str], document: Document) -> None:
    for i, correlation in enumerate(cfg.prior.correlations if cfg.prior else ()):
        for j, label in enumerate(correlation.between):
            if label not in labels:
                raise ConfigError(
                    f"prior.correlations[{i}].between: there is no state {label!r}",
                    location=document.locate(("prior", "correlations", i, "between", j)),
                    hint=did_you_mean(label, labels),
                )


def _refuse_zero_noise(m: Measurement, document: Document) -> None:
    diagonal = np.diag(np.array(m.covariance).reshape(len(m.all_rows), -1))
    if np.any(diagonal <= 0.0) and not m.perfect:
        raise ConfigError(
            f"measurement {m.name!r} has zero noise (R = 0)",
            location=document.locate(("measurements", m.name, "noise")),
            hint="a perfect measurement is a strong claim: say so with perfect: true, or give its noise",
        )


def _apply(
    policies: list[Policy], model: Model, reference: Mapping[str, FloatArray], document: Document
) -> tuple[Model, list[Change]]:
    changes: list[Change] = []
    for i, policy in enumerate(policies):
        try:
            model, made = apply_policies(model, [policy], reference, earlier=changes)
        except ConfigError as error:
            error.location = error.location or document.locate(("policies", i))
            raise
        changes.extend(made)
    return model, changes


def _checks(cfg: FilterConfig, provider: Any, model: Model, document: Document) -> tuple[OperationCheck, ...]:
    nominal = cfg.nominal or {}
    try:
        return settle_operations(
            provider.operations,
            nominal.get("operations", {}),
            model.structure,
            provider.kind,
            allow_mismatch=bool(nominal.get("allow_mismatch", False)),
        )
    except ConfigError as error:
        error.location = error.location or document.locate(("nominal", "operations"))
        raise


def _stepped_turns(model: Model, provider: Any, settings: ProviderSettings, document: Document) -> None:
    try:
        refuse_stepped_turns(model, provider.variables(settings.computed))
    except ConfigError as error:
        document.placed(error, ("policies",))
        raise


def _exact_quotient(model: Model, plan: Plan, provider: Any, settings: ProviderSettings, document: Document) -> None:
    try:
        refuse_inexact_quotient(model, plan, provider, settings.computed)
    except ConfigError as error:
        error.location = error.location or document.locate(("policies", len(document.data["policies"]) - 1))
        raise


def _estimation(cfg: FilterConfig, build: Builder) -> Estimation:
    made: Estimation = build.make("estimator", cfg.estimator or {"kind": "kalman"}, ("estimator",))
    fault = misplaced_section(cfg) if made.kind == "determination" else None
    if made.kind != "determination" and not cfg.blocks:
        fault = ConfigError(
            "there are no blocks: a filter has states to estimate",
            hint="write blocks, or take what the nominal provider computes by itself: estimator: {kind: determination}",
        )
    if fault is not None:
        build.document.placed(fault, ())
        raise fault
    return made


def filter_path(document: Document) -> tuple[str, ...]:
    """Where the settings of the recursion stand: in a bank a level deeper."""
    return ("estimator", "filter") if document.holds(("estimator", "filter")) else ("estimator",)


def _refuse_unknown_gates(estimator: RecursionSettings, build: Builder, plan: Plan) -> None:
    names = {m.name for m in (*plan.whole.measurements, *plan.measurements)}
    for name in estimator.gates:
        if name not in names:
            raise ConfigError(
                f"estimator.gates names no measurement: {name!r}",
                location=build.document.locate((*filter_path(build.document), "gates", name)),
                hint=did_you_mean(name, names),
            )


def _refuse_health(cfg: FilterConfig, plan: Plan, kind: str, document: Document) -> None:
    fault = health_fault(cfg.health, {m.name: m.gate is not None for m in plan.measurements}, kind)
    if fault is not None:
        document.placed(fault, ())
        raise fault


def _plan(
    model: Model, provider: Any, settings: ProviderSettings, estimator: RecursionSettings, document: Document
) -> Plan:
    layout = NominalLayout(provider.variables(settings.computed), (*model.derived, *model.held))
    gates = {m.name: estimator.gates.get(m.name, estimator.gate) for m in model.measurements}
    try:
        plan = make_plan(model, layout, provider.slots, discretisation(estimator), gates)
    except ConfigError as error:
        error.location = error.location or document.locate(("process",))
        raise
    return _cut(estimator, model, plan, document) if isinstance(estimator, DecentralisedConfig) else plan


def _cut(estimator: DecentralisedConfig, model: Model, plan: Plan, document: Document) -> Plan:
    try:
        return cut_plan(estimator, model, plan)
    except ConfigError as error:
        document.placed(error, ("estimator",))
        raise
