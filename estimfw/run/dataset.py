"""The labelled result: what a run collected, as an xarray dataset."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from estimfw.config.compose import Problem
from estimfw.estimators.bank import weights
from estimfw.kernels.fuse import MEANINGS
from estimfw.model.model import Model
from estimfw.model.parts import Output
from estimfw.run.event_columns import event_columns
from estimfw.run.exchanged import exchange_json
from estimfw.run.plausibility import implausible_events, unmeasured
from estimfw.run.run import Collected
from estimfw.run.staging import stages_json
from estimfw.units.unit_text import parse_unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["result_dataset"]


def result_dataset(done: Collected) -> xr.Dataset:
    """The result of a run as a dataset (see `estimfw.run.result_names` for its variables), SI units.

    Nothing in it depends on the clock: the same config, data and seed make the same dataset.
    """
    import xarray as xr

    problem = done.prepared.problem
    time = done.prepared.steps.time
    variables: dict[str, Any] = {
        **_states(done),
        **_outputs(done),
        **_truths(done),
        **_measurements(done),
        **_honest(done),
        **_bank(done),
        **_smoothed(done),
        **_recorded(done),
    }
    coordinates: dict[str, Any] = {
        "time": ("time", time, {"units": "s", "long_name": "time, end of the step"}),
        **_state_axes(done),
        **({"member": ("member", [one.label for one in done.prepared.members])} if done.bank is not None else {}),
    }
    outputs = [o for o, _ in problem.plan.outputs]
    if outputs:
        coordinates["output_meaning"] = ("output", output_meanings(problem.model, outputs))
        coordinates |= _axis(
            "output",
            [label for o in outputs for label in o.labels],
            [u for o in outputs for u in o.units],
            [u for o in outputs for u in o.display_units],
        )
    for m in problem.plan.measurements:
        j = [x.name for x in problem.plan.measurements].index(m.name)
        coordinates[f"{m.name}_time"] = (f"{m.name}_time", time[done.disposition[:, j] >= 0], {"units": "s"})
        coordinates[f"{m.name}_row"] = (f"{m.name}_row", [_row(label) for label in m.labels])
    exchange = exchange_json(done.prepared)
    attributes = {
        "title": problem.config.name,
        "provenance": json.dumps(provenance(done)),
        "policies": json.dumps([c.as_json() for c in problem.changes]),
        "equivalence": json.dumps([c.as_json() for c in problem.checks]),
        "undetermined": json.dumps(problem.undetermined),
        **_smoother(problem),
        **({"exchange": json.dumps(exchange)} if exchange is not None else {}),
        **({"truth_model": json.dumps(problem.truth.model.as_json())} if problem.truth is not None else {}),
        **({"stages": json.dumps(stages_json(problem.plan, done.prepared.steps))} if problem.plan.stages else {}),
    }
    made = xr.Dataset(variables, coordinates, attributes)
    return made.assign(event_columns((*done.events, *implausible_events(made))))


def _states(done: Collected) -> dict[str, Any]:
    """What is told of states; nothing of a determination."""
    if not done.prepared.plan.states:
        return {}
    return {
        "estimate": (("time", "state"), done.estimate),
        "sigma": (("time", "state"), done.sigma),
        "prior_sigma": ("state", np.sqrt(np.diag(done.final.prior[1]))),
        "covariance": (("covariance_time", "state", "state_column"), done.covariance),
        **_unmeasured(done),
    }


def _bank(done: Collected) -> dict[str, Any]:
    if done.bank is None:
        return {}
    return {
        "bank_score": (("time", "member"), done.bank.score),
        "bank_weight": (("time", "member"), weights(done.bank.score)),
        "bank_member": ("time", done.bank.best.astype(np.int32)),
    }


def _smoothed(done: Collected) -> dict[str, Any]:
    if done.smoothed is None:
        return {}
    made: dict[str, Any] = {
        "smoothed": (("time", "state"), done.smoothed.estimate),
        "smoothed_sigma": (("time", "state"), done.smoothed.sigma),
        "smoothed_covariance": (("covariance_time", "state", "state_column"), done.smoothed.covariance),
    }
    if done.truth is not None:
        made["smoothed_error"] = (("time", "state"), done.smoothed.estimate - done.truth)
    if done.output.shape[1]:
        made["smoothed_output"] = (("time", "output"), done.smoothed.output)
        made["smoothed_output_sigma"] = (("time", "output"), done.smoothed.output_sigma)
    if done.output.shape[1] and done.smoothed_output_error is not None:
        made["smoothed_output_error"] = (("time", "output"), done.smoothed_output_error)
    return made


def _recorded(done: Collected) -> dict[str, Any]:
    """What a device recorded of the outputs, and the unit in which their errors are told."""
    if done.recorded is None:
        return {}
    periods = [o.period for o, _ in done.prepared.plan.outputs for _ in o.components]
    return {
        "output_recorded": (("time", "output"), done.recorded.value),
        "output_error_scale": (("time", "output"), done.recorded.error_scale),
        "output_error_unit": ("output", list(done.recorded.error_units)),
        "output_period": ("output", np.array(periods)),
    }


def _state_axes(done: Collected) -> dict[str, Any]:
    model, time = done.prepared.problem.model, done.prepared.steps.time
    if not model.states:
        return {}
    return {
        "covariance_time": ("covariance_time", time[done.covariance_index], {"units": "s"}),
        "state_column": ("state_column", list(model.states)),
        **_axis(
            "state",
            [label for b in model.blocks for label in b.labels],
            [b.unit for b in model.blocks for _ in b.axes],
            [b.display_unit or b.unit for b in model.blocks for _ in b.axes],
        ),
        "state_meaning": ("state", list(model.state_meanings)),
    }


def output_meanings(model: Model, outputs: Sequence[Output]) -> list[str]:
    """For each component of each output its label, and with it the combinations that it is made of where there are such."""
    changed = {s: m for s, m in zip(model.states, model.state_meanings, strict=True) if s != m}
    made: list[str] = []
    for output in outputs:
        read = np.any(model.jacobian(output).pattern, axis=0)
        parts = [changed[s] for s, own in zip(model.states, read, strict=True) if own and s in changed]
        made += [f"{label} by {', '.join(parts)}" if parts else label for label in output.labels]
    return made


def _axis(name: str, labels: list[str], units: list[str], display: list[str]) -> dict[str, Any]:
    scales = [float(parse_unit(u).scale) / float(parse_unit(d).scale) for u, d in zip(units, display, strict=True)]
    return {
        name: (name, labels),
        f"{name}_unit": (name, units),
        f"{name}_display_unit": (name, display),
        f"{name}_display_scale": (name, np.array(scales)),
    }


def _row(label: str) -> str:
    return label[label.index("[") + 1 : -1] if "[" in label else label


def _outputs(done: Collected) -> dict[str, Any]:
    if not done.output.shape[1]:
        return {}
    value = {"output_value": (("time", "output"), done.output)}
    if not done.prepared.plan.states:
        return value
    return {**value, "output_sigma": (("time", "output"), done.output_sigma)}


def _honest(done: Collected) -> dict[str, Any]:
    if done.honest is None:
        return {}
    made: dict[str, Any] = {
        "honest_sigma": (("time", "state"), done.honest.sigma),
        "honest_covariance": (("covariance_time", "state", "state_column"), done.honest.covariance),
    }
    if done.output.shape[1]:
        made["output_honest_sigma"] = (("time", "output"), done.honest.output_sigma)
    return made


def _truths(done: Collected) -> dict[str, Any]:
    if done.truth is None:
        return {}
    known: dict[str, Any] = {}
    if done.prepared.plan.states:
        known["truth"] = (("time", "state"), done.truth)
        known["error"] = (("time", "state"), done.estimate - done.truth)
    if done.output.shape[1] and done.output_truth is not None:
        known["output_truth"] = (("time", "output"), done.output_truth)
        known["output_error"] = (("time", "output"), done.output_error)
    return known


def _measurements(done: Collected) -> dict[str, Any]:
    made: dict[str, Any] = {}
    at = 0
    plan = done.prepared.plan
    for j, m in enumerate(plan.measurements):
        due = done.disposition[:, j] >= 0
        own = slice(at, at + m.rows)
        at += m.rows
        rows, time = f"{m.name}_row", f"{m.name}_time"
        threshold = plan.thresholds(m)
        made[f"{m.name}_innovation"] = ((time, rows), done.innovation[due, own], {"units": m.unit})
        made[f"{m.name}_innovation_sigma"] = ((time, rows), done.innovation_sigma[due, own], {"units": m.unit})
        made[f"{m.name}_nis"] = (time, done.nis[due, j])
        made[f"{m.name}_used"] = (time, done.used[due, j].astype(np.int8))
        made[f"{m.name}_disposition"] = (
            time,
            done.disposition[due, j].astype(np.int8),
            {
                "flag_values": np.arange(len(MEANINGS), dtype=np.int8),
                "flag_meanings": " ".join(MEANINGS),
                "unit": m.unit,
                "threshold": float("nan") if threshold is None else float(threshold[-1]),
            },
        )
    return made


def _unmeasured(done: Collected) -> dict[str, Any]:
    prepared = done.prepared
    steps, problem = prepared.steps, prepared.problem
    elapsed = steps.time[done.covariance_index] - steps.start
    corrected = frozenset(slot.quantity for slot in problem.provider.slots)
    mean, sigma = unmeasured(problem.model, problem.reference, done.final.prior, elapsed, corrected)
    axes = ("covariance_time", "state")
    return {"unmeasured_mean": (axes, mean), "unmeasured_sigma": (axes, sigma)}


def provenance(done: Collected) -> dict[str, Any]:
    """Where the result comes from: all that is needed to make it again."""
    problem = done.prepared.problem
    text = json.dumps(problem.document.data, sort_keys=True)
    return {
        "config": problem.document.data,
        "config_sha256": hashlib.sha256(text.encode()).hexdigest(),
        "config_files": [{"name": Path(p).name, "sha256": _digest(Path(p))} for p in problem.document.files],
        "plan_hash": problem.plan.hash,
        "time_invariant": problem.plan.time_invariant,
        "record": dict(done.prepared.record.attributes),
        "start": done.prepared.start.source,
        "start_found": bool(done.prepared.start.covariance),
        **({"members": len(done.prepared.members)} if done.bank is not None else {}),
        "seed": getattr(problem.source, "seed", None),
        "kernel": done.prepared.scan.name,
        "estimator": problem.kind,
        **_recursion(problem),
        "versions": versions(done.prepared.scan.name),
    }


def _recursion(problem: Problem) -> dict[str, Any]:
    """How states are estimated, where there are some."""
    if not problem.plan.states:
        return {}
    return {
        "covariance": problem.estimator.covariance,
        "loop": problem.estimator.loop,
        "discretisation": problem.plan.discretisation.describe(),
    }


def _smoother(problem: Problem) -> dict[str, Any]:
    cfg = problem.estimator.smoother
    return {"smoother": json.dumps(cfg.model_dump())} if cfg is not None else {}


def _digest(path: Path) -> str | None:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


def versions(kernel: str) -> dict[str, str]:
    """Of the program, of the installed plugins, and of what computes."""
    names = {"estimfw", "numpy", "scipy"} | ({"numba"} if kernel == "numba" else set())
    names |= {e.dist.name for e in metadata.entry_points(group="estimfw") if e.dist is not None}
    found = {name: metadata.version(name) for name in sorted(names)}
    return {**found, "python": platform.python_version()}
